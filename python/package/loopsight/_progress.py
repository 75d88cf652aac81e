"""Progress of long work, and what is known before it ends."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from ._optional import needed

Progress = bool | Callable[[str, int, int], object]
Report = Callable[[str, int, int], object]
#: What gets each result that is known before long work ends.
Early = Callable[[dict[str, Any]], object] | None


def bars() -> Any:
    """Makes a bar."""
    return needed("progress bars need", "tqdm.auto").tqdm


def hearing(early: Early) -> Callable[[str], object] | None:
    """What gets the same as JSON."""
    return None if early is None else lambda text: early(json.loads(text))


@contextmanager
def reporting(progress: Progress) -> Iterator[Report | None]:
    """What gets stage, done and total: a bar of tqdm for ``True``, nobody for ``False``."""
    if progress is False or progress is None:
        yield None
    elif progress is True:
        with _bars() as report:
            yield report
    else:
        yield progress


@contextmanager
def _bars() -> Iterator[Report]:
    tqdm = bars()
    bar: Any = None

    def report(stage: str, done: int, total: int) -> None:
        nonlocal bar
        if bar is None or bar.desc != f"{stage}: ":
            if bar is not None:
                bar.close()
            bar = tqdm(total=total, leave=False)
            bar.set_description(stage)
        bar.total = total
        bar.update(done - bar.n)

    try:
        yield report
    finally:
        if bar is not None:
            bar.close()
