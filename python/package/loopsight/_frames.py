"""Data frames of what was answered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


def frame(columns: Mapping[str, Any], index: Sequence[str] | None = None) -> Any:
    """A pandas data frame of columns."""
    try:
        import pandas
    except ImportError as missing:
        raise ImportError("frames need the package pandas: pip install pandas") from missing
    return pandas.DataFrame(dict(columns), index=None if index is None else list(index))
