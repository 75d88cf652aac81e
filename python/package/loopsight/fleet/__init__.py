"""A fleet: the logs of many robots, on an engine that is there already, and what they say together.

>>> import loopsight as ls                                          # doctest: +SKIP
>>> found = ls.fleet.improve("logs.parquet", "model.toml", out="found.parquet")     # doctest: +SKIP
>>> ls.fleet.report(found, "fleet.html")                            # doctest: +SKIP
"""

from ._engines import ENGINES, engine_named
from ._improve import improve
from ._report import report
from ._statistics import effects, missing, readings, siblings, trends

__all__ = [
    "ENGINES",
    "effects",
    "engine_named",
    "improve",
    "missing",
    "readings",
    "report",
    "siblings",
    "trends",
]
