"""Data frames of what was answered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ._optional import needed


def frame(columns: Mapping[str, Any], index: Sequence[str] | None = None) -> Any:
    """A pandas data frame of columns."""
    pandas = needed("frames need", "pandas")
    return pandas.DataFrame(dict(columns), index=None if index is None else list(index))
