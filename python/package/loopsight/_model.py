"""Models."""

from __future__ import annotations

from os import PathLike
from typing import NamedTuple

from . import _engine
from ._trace import Effect


class Parameter(NamedTuple):
    """What a model says of one of its parameters."""

    name: str
    """Name within the model: ``K_A``, ``coulomb_friction.level``."""
    symbol: str
    """Symbol in the equations."""
    unit: str
    """SI unit."""
    doc: str
    """One sentence."""
    value: float | None
    """Its value; ``None`` where a fit has to find it."""
    range: tuple[float, float]
    """Least and greatest admissible value."""
    estimated: bool
    """Whether a fit estimates it."""


class Model:
    """A plant with effects, sensors and parameter values.

    Made by `from_file`, `from_toml` or `from_plant`. A model does not change: `with_value` and `add` return
    another one.

    Examples
    --------
    >>> import loopsight as ls
    >>> model = ls.Model.from_toml("[plant.dc_axis]\\n")
    >>> [p.name for p in model.parameters if p.value is None]
    ['K_A', 'K_C']
    """

    def __init__(self, engine: _engine.Model) -> None:
        self._engine = engine

    @classmethod
    def from_file(cls, path: str | PathLike[str]) -> Model:
        """Reads a model file (TOML).

        Raises
        ------
        Error
            The file says something that cannot be: with line, column, and the nearest right thing.
        """
        return cls(_engine.Model.from_file(path))

    @classmethod
    def from_toml(cls, text: str, name: str = "model.toml") -> Model:
        """Makes a model of a text; `name` stands for the file in messages and titles."""
        return cls(_engine.Model.from_toml(text, name))

    @classmethod
    def from_plant(cls, plant: str) -> Model:
        """The plain model of a plant, by its id, without values but for those that have a default.

        ``loopsight.parts("plant")`` lists the ids.
        """
        return cls(_engine.Model.from_plant(plant))

    @property
    def name(self) -> str:
        """Name of the robot, for titles."""
        return self._engine.name

    @property
    def plant(self) -> str:
        """Id of the plant."""
        return self._engine.plant

    @property
    def effects(self) -> list[tuple[str, list[str]]]:
        """The effects in the model, each with its channels."""
        return self._engine.effects

    @property
    def parameters(self) -> list[Parameter]:
        """The parameters: those of the plant first, then those of the effects."""
        return [
            Parameter(name, symbol, unit, doc, value, (low, high), estimated)
            for name, symbol, unit, doc, value, (low, high), estimated in self._engine.parameters()
        ]

    def value(self, name: str) -> float | None:
        """The value of a parameter in its SI unit; ``None`` where it has none, or is not there."""
        return self._engine.value(name)

    def with_value(self, name: str, value: float) -> Model:
        """The same model with another value of one parameter, in its SI unit."""
        return Model(self._engine.with_value(name, float(value)))

    def add(self, effect: str, at: str | list[str] | None = None) -> Model:
        """The same model with one effect more, with parameters that do nothing until a fit finds them.

        Parameters
        ----------
        effect : str
            Id of the effect, e.g. ``"coulomb_friction"``.
        at : str or list of str, optional
            Channels it acts on; by default all of the first kind it fits.
        """
        channels = [at] if isinstance(at, str) else list(at or [])
        session = _engine.Session(self._engine, None, [], None, None)
        added = session.add(effect, channels).model
        assert added is not None, "an effect was added to a model"
        return Model(added)

    def with_effect(self, effect: Effect) -> Model:
        """The same model with an effect of one's own, made of a Python function by `effect`."""
        text = self.to_toml().rstrip("\n")
        return Model.from_toml(f"{text}\n\n{effect.to_toml()}", self._engine.file)

    def with_candidate(self, effect: Effect) -> Model:
        """The same model, for which `diagnose` and `improve` try an effect of one's own beside those of the library.

        It is not in the model: `fit`, `compare` and `simulate` do as if it were not there.
        """
        text = self.to_toml().rstrip("\n")
        return Model.from_toml(f"{text}\n\n{effect.to_toml('candidate')}", self._engine.file)

    def to_toml(self) -> str:
        """The text it was made from, comments included, with its present values."""
        return self._engine.to_toml()

    def save(self, path: str | PathLike[str]) -> None:
        """Writes `to_toml` to a file, whole or not at all."""
        self._engine.save(path)

    def __repr__(self) -> str:
        effects = "".join(f" + {effect}" for effect, _ in self.effects)
        return f"<loopsight.Model {self.name}: {self.plant}{effects}>"
