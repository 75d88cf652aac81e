"""Adaptive control you can see into: compare a model with measurements, see where it fails, learn which
physical effect is missing, add it and watch the error fall.

>>> import loopsight as ls
>>> found = ls.diagnose("model.toml", "log.csv")       # doctest: +SKIP
>>> print(found)                                       # doctest: +SKIP
>>> found.plot()                                       # doctest: +SKIP
"""

from __future__ import annotations

from os import PathLike

from . import _engine, fleet
from ._error import Error
from ._log import Log
from ._model import Model, Parameter
from ._results import Comparison, Diagnosis, Fit, Improvement, Record, Result, Run
from ._session import (
    Session,
    compare,
    diagnose,
    experiment,
    fit,
    improve,
    inspect,
    run,
    simulate,
)
from ._trace import Effect, Expression, Free, effect

__all__ = [
    "Comparison",
    "Diagnosis",
    "Effect",
    "Error",
    "Expression",
    "Fit",
    "Free",
    "Improvement",
    "Log",
    "Model",
    "Parameter",
    "Record",
    "Result",
    "Run",
    "Session",
    "check",
    "compare",
    "diagnose",
    "effect",
    "experiment",
    "explain",
    "fit",
    "fleet",
    "improve",
    "inspect",
    "parts",
    "run",
    "simulate",
]

__version__ = "0.1.0"


def check(*files: str | PathLike[str]) -> Result:
    """Whether model, loop, experiment and log files are right: ``files``, each with ``summary`` and ``mistake``
    (line and column)."""
    return Result(_engine.check(list(files)))


def explain(id: str) -> Result:
    """Everything about a part: equation, parameters, channels, symptom, remedy, source."""
    return Result(_engine.explain(id))


def parts(role: str | None = None, *, plant: str | None = None) -> Result:
    """What can be composed: all, or those of a role (``"plant"``, ``"effect"``, ``"estimator"``,
    ``"controller"``, ``"driver"``). With `plant` the effects that fit it, each with its channels."""
    return Result(_engine.parts(role, plant))
