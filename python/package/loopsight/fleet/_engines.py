"""Engines that run tasks: Ray, Dask, or the process pool of the standard library."""

from __future__ import annotations

import importlib
import importlib.util
import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from .._error import Error

#: What a task does: it gets a task and answers with a row.
Work = Callable[[Any], dict[str, Any]]
#: A task's place in the list, and its row, or why there is none.
Done = tuple[int, dict[str, Any] | str]
#: Runs `work` on each task, on so many workers, each task again so many times when its worker dies.
Engine = Callable[[Work, Sequence[Any], int, int], Iterator[Done]]

#: Tasks that a worker of the standard library's pool does before a fresh one takes its place: what a worker
#: holds does not grow without end.
TASKS_PER_WORKER = 200
#: That option of the pool: Python 3.10 does not have it yet.
FRESH: dict[str, Any] = {"max_tasks_per_child": TASKS_PER_WORKER} if sys.version_info >= (3, 11) else {}


def leave_with(parent: int) -> None:
    """Begins a worker: it ends when the process `parent` is gone. A pool's workers do not see that for themselves,
    since each holds both ends of the queue it waits at."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def processes(work: Work, tasks: Sequence[Any], workers: int, retries: int) -> Iterator[Done]:
    """The process pool of the standard library.

    A worker that dies takes the whole pool with it. Then those that were at work are run again one by one, so
    that only the task that kills is blamed.
    """
    waiting = list(range(len(tasks)))[::-1]
    deaths = [0] * len(tasks)
    suspects: list[int] = []
    while waiting or suspects:
        alone = bool(suspects)
        begun: dict[Future[dict[str, Any]], int] = {}
        with ProcessPoolExecutor(
            max_workers=1 if alone else workers,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=leave_with,
            initargs=(os.getpid(),),
            **FRESH,
        ) as pool:
            try:
                while True:
                    queue = suspects if alone else waiting
                    while queue and len(begun) < (1 if alone else 2 * workers):
                        task = queue.pop()
                        begun[pool.submit(work, tasks[task])] = task
                    if not begun:
                        break
                    for future in wait(begun, return_when=FIRST_COMPLETED).done:
                        row = future.result()
                        yield begun.pop(future), row
            except BrokenProcessPool:
                for future, task in begun.items():
                    if future.done() and not future.cancelled() and future.exception() is None:
                        yield task, future.result()
                        continue
                    deaths[task] += alone
                    if deaths[task] > retries:
                        yield task, f"its worker died {deaths[task]} times"
                    else:
                        suspects.append(task)


def ray(work: Work, tasks: Sequence[Any], workers: int, retries: int) -> Iterator[Done]:
    """Ray: the cluster that is there, or a local one."""
    engine: Any = importlib.import_module("ray")
    if not engine.is_initialized():
        engine.init(num_cpus=workers, include_dashboard=False, log_to_driver=False)
    remote = engine.remote(num_cpus=1, max_retries=retries)(work)
    at_once = max(2 * workers, 2 * int(engine.cluster_resources().get("CPU", workers)))
    waiting = list(range(len(tasks)))[::-1]
    begun: dict[Any, int] = {}
    while waiting or begun:
        while waiting and len(begun) < at_once:
            task = waiting.pop()
            begun[remote.remote(tasks[task])] = task
        ready, _ = engine.wait(list(begun), num_returns=1)
        for reference in ready:
            task = begun.pop(reference)
            try:
                yield task, engine.get(reference)
            except engine.exceptions.RayError as error:
                yield task, f"its worker died: {type(error).__name__}"


def dask(work: Work, tasks: Sequence[Any], workers: int, retries: int) -> Iterator[Done]:
    """Dask: the client that is there, or a local cluster of processes."""
    engine: Any = importlib.import_module("distributed")
    own = None
    try:
        client = engine.default_client()
    except ValueError:
        own = client = engine.Client(n_workers=workers, threads_per_worker=1, dashboard_address=None)
    try:
        begun = {}
        for at, task in enumerate(tasks):
            begun[client.submit(work, task, retries=retries, pure=False)] = at
        for future in engine.as_completed(list(begun)):
            error = future.exception()
            if error is None:
                yield begun[future], future.result()
            else:
                yield begun[future], f"its worker died: {type(error).__name__}"
            future.release()
    finally:
        if own is not None:
            own.close()


#: The engines by name, in the order in which they are looked for.
ENGINES: dict[str, tuple[str | None, Engine]] = {
    "ray": ("ray", ray),
    "dask": ("distributed", dask),
    "processes": (None, processes),
}


def engine_named(name: str | None) -> Engine:
    """The engine of that name; for ``None`` the first one that is installed.

    Raises
    ------
    Error
        There is no such engine, or it is not installed.
    """
    if name is not None and name not in ENGINES:
        raise Error(f"engine is `{name}`, expected one of {', '.join(ENGINES)}")
    for known, (package, engine) in ENGINES.items():
        if name not in (None, known):
            continue
        if package is None or importlib.util.find_spec(package) is not None:
            return engine
        if name is not None:
            raise Error(f"the engine `{name}` needs the package {package}: pip install {package}")
    return processes


def cores() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
