"""What the engine answers."""

from __future__ import annotations

import html
import json
from collections.abc import Iterable
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from . import _engine, _plots
from ._error import Error
from ._files import whole
from ._frames import frame
from ._log import Log
from ._model import Model


class Record(dict[str, Any]):
    """A part of an answer: a dict whose keys are attributes, too."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            known = ", ".join(self)
            raise AttributeError(f"there is no `{name}` here, expected one of {known}") from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]


class Result:
    """An answer of the engine.

    Every key of the JSON that the command prints is an attribute: ``result.verdict``, ``result.nrmse``. Numbers
    are in SI units; ``None`` stands for one that is not finite. The keys are described by the JSON Schemas in
    ``docs/schema/`` of the project.
    """

    def __init__(self, answer: _engine.Answer, command: str = "") -> None:
        self._answer = answer
        self._command = command
        self._data: Record = json.loads(answer.to_json(), object_pairs_hook=Record)

    def to_dict(self) -> dict[str, Any]:
        """The answer as dicts, lists, texts and numbers."""
        answer: dict[str, Any] = json.loads(self._answer.to_json())
        return answer

    def to_json(self) -> str:
        """Exactly what the command prints with ``--json``."""
        return self._answer.to_json()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self._data, name)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._data]

    def __str__(self) -> str:
        return str(self._data.get("summary") or self.to_json())

    def __repr__(self) -> str:
        return f"<loopsight.{type(self).__name__}: {self}>"

    @property
    def model(self) -> Model | None:
        """The model that came of it: fitted, improved, or with one effect more."""
        model = self._answer.model
        return None if model is None else Model(model)

    @property
    def log(self) -> Log | None:
        """The log that came of it: a simulated one, or the inputs of a planned experiment."""
        log = self._answer.log
        return None if log is None else Log(log)

    def parameters_frame(self) -> Any:
        """The parameters as a pandas data frame: value, unit, standard error, 95 % interval, verdict."""
        return frame_of(self._data.get("parameters") or {})

    def report(self, path: str | PathLike[str]) -> Path:
        """Writes a page with pictures that opens offline.

        Parameters
        ----------
        path : path
            The file to write, e.g. ``"page.html"``.
        """
        page = self._answer.page(self._command)
        target = Path(fspath(path))
        with whole(target) as part:
            part.write_text(page, encoding="utf-8")
        return target

    def _repr_html_(self) -> str:
        paragraphs = "".join(f"<p>{html.escape(line)}</p>" for line in str(self).splitlines())
        tables = f"{self._details()}{_parameters(self._data.get('parameters'))}"
        return f'<div class="loopsight">{paragraphs}{tables}</div>'

    def _details(self) -> str:
        """What a notebook shows between the summary and the parameters, in HTML."""
        return ""


class SeriesResult(Result):
    """An answer with what was measured beside what the model says."""

    def series(self) -> list[dict[str, Any]]:
        """What was measured and what the model says, one dict for each model, run and signal.

        Returns
        -------
        list of dict
            With ``of`` (``model``, ``nominal``, ``fitted`` or ``best``), ``run``, ``signal``, ``unit``, and the
            arrays ``time_s``, ``measured``, ``model`` (free run), ``residual``, ``one_step``, each of the shape
            ``(samples,)`` and in that unit.
        """
        return self._answer.series()

    def series_frame(self) -> Any:
        """The series as one long pandas data frame."""
        import numpy as np

        numbers = ("time_s", "measured", "model", "residual", "one_step")
        columns: dict[str, list[Any]] = {name: [] for name in ("of", "run", "signal", "unit", *numbers)}
        for one in self.series():
            samples = len(one["time_s"])
            for name, values in columns.items():
                values.append(one[name] if name in numbers else np.full(samples, one[name], dtype=object))
        return frame({name: np.concatenate(values) if values else [] for name, values in columns.items()})

    def plot(self, backend: str = "matplotlib", **options: Any) -> Any:
        """Draws measurement and model, and the residual below, for each signal.

        Parameters
        ----------
        backend : {"matplotlib", "plotly"}
            What draws.
        **options
            Go to ``matplotlib.pyplot.subplots`` or ``plotly.subplots.make_subplots``.

        Returns
        -------
        matplotlib.figure.Figure or plotly.graph_objects.Figure
        """
        if backend == "matplotlib":
            return _plots.matplotlib(self.series(), **options)
        if backend == "plotly":
            return _plots.plotly(self.series(), **options)
        raise Error(f"backend is `{backend}`, expected `matplotlib` or `plotly`")


class Comparison(SeriesResult):
    """How well a model agrees with a log: ``nrmse``, ``fit_percent``, ``signals``, ``where_it_fails``."""

    def _details(self) -> str:
        found = self._data["where_it_fails"]
        rows = [(one["statement"], f"{100 * one['share_of_squared_error']:.0f} %") for one in found]
        return _table(("where it fails", "share of the squared error"), rows)


class Fit(SeriesResult):
    """Parameters with intervals of 95 %: ``parameters``, ``derived``, ``nrmse``; `model` has them."""


class Diagnosis(SeriesResult):
    """Which effect a model lacks: ``verdict``, ``missing``, ``candidates``, ``not_tried``,
    ``advice``."""

    def candidates_frame(self) -> Any:
        """The explanations, best first, as a pandas data frame."""
        rows = self._data["candidates"]
        return frame(
            {
                "effect": [row["effect"] for row in rows],
                "at": [" + ".join(row["at"]) for row in rows],
                "nrmse": [row["nrmse"] for row in rows],
                "significance": [row["significance"] for row in rows],
                "indistinguishable_from": [
                    ", ".join(other["effect"] for other in row["indistinguishable_from"]) for row in rows
                ],
                "note": [row["note"] for row in rows],
            }
        )


    def _details(self) -> str:
        rows = [
            (one["effect"], " + ".join(one["at"]), _percent(one["nrmse"]), _number(one["significance"], 3))
            for one in self._data["candidates"]
        ]
        return _table(("explanation", "at", "error with it", "significance"), rows)


class Improvement(SeriesResult):
    """What was added to a model, step by step: ``steps``, ``parameters``; `model` has all of it."""

    def steps_frame(self) -> Any:
        """The steps as a pandas data frame: what was added, and the errors with it."""
        rows = self._data["steps"]
        added = [row["added"] for row in rows]
        return frame(
            {
                "added": [None if one is None else one["effect"] for one in added],
                "at": ["" if one is None else " + ".join(one["at"]) for one in added],
                "nrmse_fit": [row["nrmse_fit"] for row in rows],
                "nrmse_test": [row["nrmse_test"] for row in rows],
            }
        )


    def _details(self) -> str:
        rows = [
            (
                "the model as it is" if added is None else f"+ {added['effect']} at {' + '.join(added['at'])}",
                _percent(row["nrmse_fit"]),
                _percent(row["nrmse_test"]),
            )
            for row in self._data["steps"]
            for added in [row["added"]]
        ]
        return _table(("step", "error in the fit", "error on unseen data"), rows)


class Run(Result):
    """A control loop that ran: ``ticks``, ``tracking``, ``events``, ``failed``, ``end``."""


def frame_of(parameters: dict[str, Any]) -> Any:
    """A pandas data frame of parameters by name."""
    rows = list(parameters.values())
    interval = [row.get("interval95") or (None, None) for row in rows]
    return frame(
        {
            "value": [row["value"] for row in rows],
            "unit": [row["unit"] for row in rows],
            "std_error": [row["std_error"] for row in rows],
            "low95": [low for low, _ in interval],
            "high95": [high for _, high in interval],
            "verdict": [row["verdict"] for row in rows],
        },
        index=list(parameters),
    )


def _number(value: float | None, digits: int = 5) -> str:
    return "" if value is None else f"{value:.{digits}g}"


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100 * share:.{2 if share < 0.01 else 1}f} %"


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A table in HTML, nothing without rows."""

    def line(tag: str, cells: tuple[str, ...]) -> str:
        first, *others = (html.escape(cell) for cell in cells)
        # Notebooks align everything to the right; a sentence is not read so.
        left = f'<{tag} style="text-align: left">{first}</{tag}>'
        return f"<tr>{left}{''.join(f'<{tag}>{cell}</{tag}>' for cell in others)}</tr>"

    body = "".join(line("td", row) for row in rows)
    return f"<table><thead>{line('th', head)}</thead><tbody>{body}</tbody></table>" if body else ""


def _parameters(parameters: Any) -> str:
    """Parameters as a table in HTML."""
    if not parameters or not all(isinstance(row, dict) for row in parameters.values()):
        return ""
    rows = []
    for name, row in parameters.items():
        low, high = row.get("interval95") or (None, None)
        between = "" if low is None else f"{_number(low)} … {_number(high)}"
        rows.append((name, _number(row["value"]), row["unit"], between, row["verdict"].replace("_", " ")))
    return _table(("parameter", "value", "unit", "95 % interval", "verdict"), rows)
