"""Files that are written whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole(target: Path) -> Iterator[Path]:
    """The file to write in the place of `target`, which it becomes at the end."""
    part = target.with_name(target.name + ".part")
    yield part
    part.replace(target)
