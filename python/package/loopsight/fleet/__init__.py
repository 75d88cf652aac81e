"""A fleet: the logs of many robots, on an engine that is there already.

>>> import loopsight as ls                                          # doctest: +SKIP
>>> ls.fleet.improve("logs.parquet", "model.toml", out="found.parquet")     # doctest: +SKIP
"""

from ._engines import ENGINES, engine_named
from ._improve import effects, improve

__all__ = ["ENGINES", "effects", "engine_named", "improve"]
