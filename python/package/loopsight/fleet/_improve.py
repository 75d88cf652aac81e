"""Every log of a fleet improved, one task a log."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import re
import time
from contextlib import nullcontext
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from .._error import Error
from .._files import whole
from .._model import Model
from .._optional import needed
from .._progress import bars
from .._session import improve as improve_one
from ._engines import cores, engine_named

#: What tells one log of a fleet from another.
KEY = ("robot", "time", "path")
#: Rows that come before the table of results is written anew, and as a share of those it has: the work for all
#: writing grows with the rows, not with their square.
ROWS, SHARE = 200, 0.25


def improve(
    table: Any,
    model: Model | str | PathLike[str],
    *,
    out: str | PathLike[str],
    pages: str | PathLike[str] | None = None,
    engine: str | None = None,
    workers: int | None = None,
    retries: int = 2,
    progress: bool = False,
) -> Any:
    """Improves the model with each log of a fleet.

    A log that is broken is a row with its fault, never the end of the job. Results are safe on the disk as they
    come: in `out` and in a journal beside it. A job that was stopped or killed goes on where it was when it is
    begun again with the same `out`.

    Parameters
    ----------
    table : pandas data frame or path
        A row for each log: ``path``, and if there are such columns ``robot`` and ``time``. A path is one of a
        Parquet or CSV file; logs are looked for beside it.
    model : Model or path
        The model of these robots.
    out : path
        The Parquet file with the results.
    pages : path, optional
        A folder for the page of each log, which the command would write with ``--html``: about 0.6 MB each. Logs
        that an earlier call has done without it get none.
    engine : {"ray", "dask", "processes"}, optional
        What runs the tasks: by default the first of these that is installed.
    workers : int, optional
        How many work at once: by default as many as there are processors.
    retries : int
        How often a log is tried again whose worker died.
    progress : bool
        Whether a bar is shown (tqdm).

    Returns
    -------
    pandas.DataFrame
        A row for each log: ``robot``, ``time``, ``path``; ``status`` (``done`` or ``fault``), ``fault``;
        ``verdict``, ``summary``; ``nrmse_before``, ``nrmse_after`` (free run on validation data, as a share of the
        standard deviation); ``effects`` (``effect@channel+channel``, separated by ``; ``); ``parameters`` (JSON:
        value, unit, standard error, interval and verdict of each); ``page``, where one was written; ``seconds`` that
        it took, ``cpu_seconds`` of a processor, ``worker`` that did it (machine and process), and ``memory_mb``, the
        most that this worker ever held (known on Linux alone).
    """
    pandas = _pandas()
    rows = _tasks(pandas, table)
    known = model if isinstance(model, Model) else Model.from_file(model)
    target = Path(fspath(out))
    journal = target.with_name(target.name + ".journal")
    found = _before(pandas, target, journal)
    text, name = known.to_toml(), known._engine.file
    pending = [row for row in rows if _key(row) not in found]
    folder = None if pages is None else Path(fspath(pages)).absolute()
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
    tasks = [
        {"row": row, "toml": text, "model": name, "page": None if folder is None else str(folder / _page_of(row))}
        for row in pending
    ]
    run = engine_named(engine)
    with journal.open("a", encoding="utf-8") as log, _bar(progress, len(rows), len(found)) as bar:
        results = run(_task, tasks, workers or cores(), retries)
        unwritten = 0
        for at, row in results:
            if isinstance(row, str):
                row = {**pending[at], "status": "fault", "fault": row}
            found[_key(row)] = row
            log.write(json.dumps(row) + "\n")
            log.flush()
            os.fsync(log.fileno())
            if bar is not None:
                bar.update(1)
            unwritten += 1
            if unwritten >= max(ROWS, SHARE * len(found)):
                _write(pandas, target, found)
                log.truncate(0)
                unwritten = 0
    _write(pandas, target, found)
    journal.unlink(missing_ok=True)
    return pandas.read_parquet(target)


def _task(task: dict[str, Any]) -> dict[str, Any]:
    """One log: a row in any case."""
    # Each log is a task on a processor of its own: threads within it would only wait for each other.
    os.environ.setdefault("RAYON_NUM_THREADS", "1")
    begun, work = time.perf_counter(), time.process_time()
    row: dict[str, Any] = {**task["row"], "status": "done", "fault": None}
    try:
        model = Model.from_toml(task["toml"], task["model"])
        improved = improve_one(model, task["row"]["path"])
        if task.get("page"):
            row["page"] = str(improved.report(task["page"]))
    except Error as error:
        row |= {"status": "fault", "fault": str(error)}
    else:
        answer = improved.to_dict()
        steps = answer["steps"]
        added = [step["added"] for step in steps if step["added"] is not None]
        row |= {
            "verdict": answer["verdict"],
            "summary": answer["summary"],
            "nrmse_before": steps[0]["nrmse_test"] if steps else None,
            "nrmse_after": steps[-1]["nrmse_test"] if steps else None,
            "effects": "; ".join(f"{one['effect']}@{'+'.join(one['at'])}" for one in added),
            "parameters": json.dumps(answer["parameters"]),
        }
        if not steps:
            faults = [fault["detail"] for fault in answer["faults"]]
            row |= {"status": "fault", "fault": "; ".join(faults) or answer["summary"]}
    return row | {
        "seconds": time.perf_counter() - begun,
        "cpu_seconds": time.process_time() - work,
        "memory_mb": _most_memory(),
        "worker": f"{platform.node()}:{os.getpid()}",
    }


def _most_memory() -> float | None:
    """The most memory that this process ever held, in MB; known on Linux alone."""
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
    except OSError:
        return None
    peak = re.search(r"^VmHWM:\s*(\d+) kB", status, re.MULTILINE)
    return None if peak is None else 1.024e-3 * int(peak[1])


def _page_of(row: dict[str, Any]) -> str:
    """The name of a log's page: what one can read, and what tells it from every other."""
    told = "-".join(str(row[name]) for name in ("robot", "time") if row[name] is not None)
    readable = re.sub(r"[^A-Za-z0-9._-]+", "_", f"{told}-{Path(row['path']).stem}")[-80:].lstrip(".-")
    return f"{readable}-{hashlib.sha256(repr(_key(row)).encode()).hexdigest()[:8]}.html"


def _tasks(pandas: Any, table: Any) -> list[dict[str, Any]]:
    """The rows of the table of logs, with paths that are right from here."""
    beside = Path()
    if isinstance(table, (str, PathLike)):
        path = Path(fspath(table))
        if not path.is_file():
            raise Error(f"there is no table of logs at {path}", file=str(path))
        beside = path.parent
        table = pandas.read_csv(path) if path.suffix == ".csv" else pandas.read_parquet(path)
    if "path" not in table.columns:
        columns = ", ".join(str(column) for column in table.columns)
        raise Error(f"the table of logs has no column `path`, found {columns}")
    rows: dict[tuple[Any, ...], dict[str, Any]] = {}
    for number, record in enumerate(table.to_dict("records")):
        path = Path(str(record["path"]))
        robot, at = record.get("robot", path.stem), record.get("time")
        row = {
            "robot": str(robot),
            "time": None if at is None or at != at else str(at),
            "path": str(path if path.is_absolute() else beside / path),
        }
        if _key(row) in rows:
            raise Error(f"row {number} of the table of logs is there twice: {path}")
        rows[_key(row)] = row
    return list(rows.values())


def _key(row: dict[str, Any]) -> tuple[Any, ...]:
    return tuple(row.get(name) for name in KEY)


def _before(pandas: Any, target: Path, journal: Path) -> dict[tuple[Any, ...], dict[str, Any]]:
    """What an earlier call with the same `out` has found."""
    rows: list[dict[str, Any]] = []
    if target.is_file():
        for record in pandas.read_parquet(target).to_dict("records"):
            rows.append({name: None if value != value else value for name, value in record.items()})
    if journal.is_file():
        for line in journal.read_text(encoding="utf-8").splitlines():
            try:
                rows.append(json.loads(line))
            except json.JSONDecodeError:
                continue  # the line that was being written when the job was killed
        # What comes next begins on a line of its own.
        with journal.open("a", encoding="utf-8") as log:
            log.write("\n")
    return {_key(row): row for row in rows}


def _frame(pandas: Any, found: dict[tuple[Any, ...], dict[str, Any]]) -> Any:
    texts = (*KEY, "status", "fault", "verdict", "summary", "effects", "parameters", "page", "worker")
    numbers = ("nrmse_before", "nrmse_after", "seconds", "cpu_seconds", "memory_mb")
    rows = list(found.values())
    columns: dict[str, Any] = {
        name: pandas.Series([row.get(name) for row in rows], dtype="object") for name in texts
    }
    for name in numbers:
        columns[name] = pandas.Series([row.get(name) for row in rows], dtype="float64")
    order = [*KEY, "status", "fault", "verdict", "effects", *numbers, "worker", "page", "parameters", "summary"]
    return pandas.DataFrame(columns)[order].sort_values(list(KEY), ignore_index=True)


def _write(pandas: Any, target: Path, found: dict[tuple[Any, ...], dict[str, Any]]) -> None:
    """Writes the table of results, whole or not at all."""
    with whole(target) as part:
        _frame(pandas, found).to_parquet(part, index=False)


def _bar(shown: bool, total: int, done: int) -> Any:
    return bars()(total=total, initial=done, unit="log") if shown else nullcontext()


def _pandas() -> Any:
    # pandas writes Parquet with pyarrow.
    return needed("a fleet needs", "pandas", "pyarrow")
