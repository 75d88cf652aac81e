"""Finds what a fleet hides: every log improved, then one page about all robots."""

from __future__ import annotations

import argparse
from pathlib import Path

import loopsight as ls

HERE = Path(__file__).resolve().parent


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=HERE / "made", help="what make.py wrote")
    parser.add_argument("--engine", choices=ls.fleet.ENGINES, help="by default the first that is installed")
    parser.add_argument("--workers", type=int, help="by default as many as there are processors")
    parser.add_argument("--pages", action="store_true", help="write each log's own page, too: 0.6 MB each")
    given = parser.parse_args()
    found = ls.fleet.improve(
        given.folder / "logs.parquet",
        HERE / "model.toml",
        out=given.folder / "found.parquet",
        pages=given.folder / "pages" if given.pages else None,
        engine=given.engine,
        workers=given.workers,
        progress=True,
    )
    page = ls.fleet.report(found, given.folder / "fleet.html", title="Axes of a fleet")
    done = found[found["status"] == "done"]
    print(f"{len(found)} logs, {len(found) - len(done)} of them broken; the page: {page}")
    print(f"{found['cpu_seconds'].mean():.2f} s of a processor for each log")
    workers = found.groupby("worker")["memory_mb"].max().dropna()
    if len(workers):
        print(f"most memory of a worker: {workers.max():.0f} MB, of {len(workers)}")


if __name__ == "__main__":
    main()
