"""Effects of one's own, written as Python functions."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from ._error import Error

#: Functions of expressions, by the names that NumPy gives them.
UFUNCS = {
    "absolute": "abs",
    "fabs": "abs",
    "sign": "sign",
    "sqrt": "sqrt",
    "exp": "exp",
    "log": "ln",
    "sin": "sin",
    "cos": "cos",
    "tan": "tan",
    "arcsin": "asin",
    "arccos": "acos",
    "arctan": "atan",
    "arctan2": "atan2",
    "sinh": "sinh",
    "cosh": "cosh",
    "tanh": "tanh",
    "minimum": "min",
    "maximum": "max",
}
#: Operators of expressions, by the names that NumPy gives them.
OPERATORS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/", "power": "^", "float_power": "^"}


class Expression(np.lib.mixins.NDArrayOperatorsMixin):
    """What a function computes, as the text that the engine reads.

    It stands for a number in ``+ - * / **`` and in the functions of NumPy that the engine knows: ``numpy.tanh``,
    ``numpy.sign``, ``numpy.minimum`` and so on.
    """

    def __init__(self, text: str) -> None:
        self.text = text

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Expression:
        name = ufunc.__name__
        parts = [_text(one) for one in inputs]
        if method == "__call__" and not options:
            if name in OPERATORS:
                return Expression(f"({parts[0]} {OPERATORS[name]} {parts[1]})")
            if name == "negative":
                return Expression(f"(-{parts[0]})")
            if name == "positive":
                return self
            if name == "square":
                return Expression(f"({parts[0]} ^ 2)")
            if name in UFUNCS:
                return Expression(f"{UFUNCS[name]}({', '.join(parts)})")
        known = ", ".join(sorted(UFUNCS))
        raise Error(f"an expression has no `numpy.{name}`: it has + - * / ** and {known}")

    def __bool__(self) -> bool:
        raise Error(
            "an expression has no value yet, so nothing can be decided by it: write `numpy.maximum`, "
            "`numpy.minimum` or `numpy.tanh` in place of a condition"
        )

    def __float__(self) -> float:
        raise Error(
            "an expression has no value yet: use the functions of NumPy in place of those of `math`"
        )

    def __repr__(self) -> str:
        return f"Expression({self.text!r})"


def _text(one: Any) -> str:
    """An operand as text."""
    if isinstance(one, Expression):
        return one.text
    if isinstance(one, (int, float, np.integer, np.floating)) and not isinstance(one, bool):
        value = float(one)
        if not np.isfinite(value):
            raise Error(f"an expression cannot have the number {value}")
        return repr(value) if value >= 0 else f"({value!r})"
    raise Error(f"an expression cannot have a {type(one).__name__}: it has numbers, names and expressions")


class Free(NamedTuple):
    """A parameter of an effect of one's own.

    Examples
    --------
    >>> import loopsight as ls
    >>> level = ls.Free(0.9, "V", range=(0.0, 12.0), doc="size of the friction")
    """

    value: float
    """First guess."""
    unit: str = "1"
    """SI unit; ``channel``, ``flow`` and ``position`` stand for the units at the effect's channel."""
    range: tuple[float, float] | None = None
    """Least and greatest admissible value."""
    held: bool = False
    """A fit leaves it as it is."""
    doc: str | None = None
    """One sentence."""


class Effect:
    """An effect of one's own: a function, traced once into an expression, so that it runs at the engine's speed.

    It can still be called with numbers. Made by `effect`, and put into a model by `Model.with_effect`, or proposed by
    `Model.with_candidate`.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        at: Sequence[str],
        name: str,
        parameters: Mapping[str, Free],
    ) -> None:
        self.function = function
        self.at = list(at)
        self.name = name
        self.parameters = dict(parameters)
        arguments = list(inspect.signature(function).parameters)
        for parameter in self.parameters:
            if parameter not in arguments:
                raise Error(
                    f"the function `{function.__name__}` has no argument `{parameter}`, expected one of "
                    + ", ".join(arguments)
                )
        traced = function(**{argument: Expression(argument) for argument in arguments})
        #: The expression, as the engine reads it.
        self.force = _text(traced)

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return self.function(*arguments, **named)

    def to_toml(self, table: Literal["effect", "candidate"] = "effect") -> str:
        """The effect as it stands in a model file: as a part of the model, or as a candidate of a diagnosis."""
        lines = [f"[[{table}]]", f"[{table}.expression]", f"name = {_quoted(self.name)}"]
        lines.append(f"at = [{', '.join(_quoted(channel) for channel in self.at)}]")
        lines.append(f"force = {_quoted(self.force)}")
        if summary := inspect.getdoc(self.function):
            lines.append(f"summary = {_quoted(summary.splitlines()[0])}")
        if self.parameters:
            lines += ["", f"[{table}.expression.parameters]"]
        for name, free in self.parameters.items():
            keys = [f"value = {float(free.value)!r}", f"unit = {_quoted(free.unit)}"]
            if free.range is not None:
                low, high = (float(end) for end in free.range)
                keys.append(f"range = [{low!r}, {high!r}]")
            if free.held:
                keys.append("held = true")
            if free.doc is not None:
                keys.append(f"doc = {_quoted(free.doc)}")
            lines.append(f"{name} = {{ {', '.join(keys)} }}")
        return "\n".join(lines) + "\n"

    def __repr__(self) -> str:
        return f"<loopsight.Effect {self.name} at {' + '.join(self.at)}: {self.force}>"


def effect(
    at: str | Sequence[str], *, name: str | None = None, **parameters: Free
) -> Callable[[Callable[..., Any]], Effect]:
    """Makes an effect of a function: a decorator.

    Parameters
    ----------
    at : str or list of str
        The channels it acts on; the parameters are shared by all of them.
    name : str, optional
        Its name in reports; by default that of the function.
    **parameters : Free
        Those arguments of the function that are parameters. All others are signals: ``flow``, ``position``,
        ``nominal``, ``time``, or the name of a state or an input of the plant.

    Returns
    -------
    decorator
        It turns the function into an `Effect`. The function returns what is added at the channel, in the
        channel's unit.

    Examples
    --------
    >>> import numpy as np, loopsight as ls
    >>> @ls.effect("shaft", c=ls.Free(0.9, "V", range=(0.0, 12.0)))
    ... def friction(flow, c):
    ...     return -c * np.tanh(flow / 0.1)
    >>> friction.force
    '((-c) * tanh((flow / 0.1)))'
    >>> friction(0.2, 1.0)                                  # still a function of numbers
    np.float64(-0.9640275800758169)
    >>> model = ls.Model.from_toml("[plant.dc_axis]\\n").with_effect(friction)
    >>> model.effects
    [('friction', ['shaft'])]
    """
    channels = [at] if isinstance(at, str) else list(at)

    def decorate(function: Callable[..., Any]) -> Effect:
        return Effect(function, channels, name or function.__name__, parameters)

    return decorate


def _quoted(text: str) -> str:
    """A string of TOML: JSON's are among them."""
    return json.dumps(text, ensure_ascii=False)
