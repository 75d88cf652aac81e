"""Logs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _engine
from ._error import Error


class Log:
    """What was applied to a machine and what was measured.

    Made by `read` from a file, or by `from_frame` from what is in memory. A log is taken as it is. Its columns
    are matched with the signals of a model, and its units converted, when a `Session` is made of both.
    """

    def __init__(self, engine: _engine.Log) -> None:
        self._engine = engine

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Log:
        """Reads a log: CSV with units at the end of the names (``voltage_right_V``), SysId JSON, WPILOG, ULog,
        MCAP, ROS 2 bags (the folder), MATLAB, NumPy. The content decides, not the name.

        Raises
        ------
        Error
            The file cannot be read: with the line and the field, where it has lines.
        """
        return cls(_engine.Log.read(path))

    @classmethod
    def from_bytes(cls, data: bytes, name: str) -> Log:
        """Reads a log from bytes: what a file of it would hold; `name` stands for the file in messages."""
        return cls(_engine.Log.from_bytes(data, name))

    @classmethod
    def from_frame(
        cls,
        frame: Any,
        *,
        units: Mapping[str, str] | None = None,
        inputs: Mapping[str, str] | Iterable[str] | None = None,
        outputs: Mapping[str, str] | Iterable[str] | None = None,
        time: str | None = None,
        run: str | None = None,
        name: str = "frame",
    ) -> Log:
        """Makes a log of columns that are in memory.

        Parameters
        ----------
        frame
            A dict of arrays, a pandas or polars data frame, an Arrow table, or whatever speaks Arrow's PyCapsule
            interface (that needs pyarrow). All columns have the shape ``(rows,)``; ``nan`` is no sample.
        units : mapping, optional
            The unit of each column, e.g. ``{"speed": "rpm"}``. A column without one says it at the end of its
            name (``speed_rpm``), or is in SI units.
        inputs, outputs : mapping or names, optional
            The columns that are taken. A mapping gives them the names of the model's signals:
            ``inputs={"voltage": "u"}`` takes the column ``u`` as the signal ``voltage``. Without both every
            column of numbers is taken.
        time : str, optional
            The column of time stamps: seconds, or another unit by `units`, or dates and times. By default the
            one that is named ``time``, ``time_s``, ``timestamp`` or ``t``.
        run : str, optional
            A column that tells runs apart: rows with the same value are one run, with that name.
        name : str
            Stands for a file in messages and titles.

        Examples
        --------
        >>> import numpy as np, loopsight as ls
        >>> log = ls.Log.from_frame(
        ...     {"t": [0.0, 0.01, 0.02], "u": [0.0, 6.0, 6.0], "w": [0.0, 12.0, np.nan]},
        ...     units={"t": "s", "u": "V", "w": "rpm"}, inputs={"voltage": "u"}, outputs={"speed": "w"},
        ... )
        >>> log.columns, log.rows
        (['time_s', 'voltage_V', 'speed_rpm'], 3)
        """
        table = _table(frame)
        units = dict(units or {})
        chosen = _chosen(table, inputs, outputs)
        stamps = time if time is not None else _stamps(table)
        if stamps is None:
            raise Error(
                "the frame has no column of time stamps: name one with `time=`, its columns are "
                + ", ".join(table)
            )
        asked = [*units, *chosen.values(), stamps, *([run] if run is not None else [])]
        for column in asked:
            if column not in table:
                raise Error(f"the frame has no column `{column}`, expected one of {', '.join(table)}")
        columns: list[tuple[str, str | None, NDArray[np.float64]]] = []
        stamped = np.asarray(table[stamps])
        if stamped.dtype.kind == "M":
            stamped = (stamped - stamped[0]) / np.timedelta64(1, "s") if stamped.size else stamped
            columns.append(("time", "s", _numbers(stamps, stamped)))
        else:
            unit = units.get(stamps) or (None if stamps.startswith("time_") else "s")
            named = "time" if unit is not None else stamps
            columns.append((named, unit, _numbers(stamps, stamped)))
        everything = not chosen
        if everything:
            chosen = {column: column for column in table if column not in (stamps, run)}
        for signal, column in chosen.items():
            if column == stamps:
                continue
            values = np.asarray(table[column])
            if everything and values.dtype.kind not in "fiub" and column not in units:
                continue  # texts and the like
            columns.append((signal, units.get(column), _numbers(column, values)))
        return cls(_engine.Log.from_columns(name, _runs(table, run, columns)))

    @property
    def name(self) -> str:
        """The file, or the name under which it was handed over."""
        return self._engine.name

    @property
    def columns(self) -> list[str]:
        """The columns, with units at the end of the names."""
        return self._engine.columns

    @property
    def runs(self) -> int:
        """Number of runs that the log itself separates."""
        return self._engine.runs

    @property
    def rows(self) -> int:
        """Number of rows of all runs."""
        return self._engine.rows

    def __getitem__(self, column: str) -> NDArray[np.float64]:
        """The values of a column, those of all runs one after another, shape ``(rows,)``; ``nan`` is no
        sample."""
        return self._engine.column(column)

    def to_dict(self) -> dict[str, NDArray[np.float64]]:
        """All columns as arrays of shape ``(rows,)``."""
        return {column: self[column] for column in self.columns}

    def to_frame(self) -> Any:
        """All columns as a pandas data frame."""
        from ._frames import frame

        return frame(self.to_dict())

    def part(self, start: int, end: int) -> Log:
        """The rows `start` to `end` (without it), counted from 0 over all runs."""
        return Log(self._engine.part(start, end))

    def without_runs(self, *names: str) -> Log:
        """The log without the runs of these names, as faults name them."""
        return Log(self._engine.without_runs(list(names)))

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the log as CSV, whole or not at all."""
        self._engine.save(path)

    def __repr__(self) -> str:
        return f"<loopsight.Log {self.name}: {self.rows} rows of {', '.join(self.columns)}>"


def _table(frame: Any) -> dict[str, Any]:
    """The columns of a frame by name."""
    if isinstance(frame, Mapping):
        return {str(name): values for name, values in frame.items()}
    names = getattr(frame, "column_names", None)
    if names is None and hasattr(frame, "columns") and hasattr(frame, "__getitem__"):
        return {str(name): frame[name] for name in frame.columns}
    if hasattr(frame, "__arrow_c_stream__") and not hasattr(frame, "column"):
        try:
            import pyarrow
        except ImportError as missing:
            raise Error("a frame of this kind needs the package pyarrow: pip install pyarrow") from missing
        frame = pyarrow.table(frame)
        names = frame.column_names
    if names is None:
        raise Error(
            f"a frame is a dict of arrays, a data frame or an Arrow table, found {type(frame).__name__}"
        )
    return {name: frame.column(name) for name in names}


def _chosen(
    table: Mapping[str, Any],
    inputs: Mapping[str, str] | Iterable[str] | None,
    outputs: Mapping[str, str] | Iterable[str] | None,
) -> dict[str, str]:
    """Signals, each with the column that holds it."""
    chosen: dict[str, str] = {}
    for some in (inputs, outputs):
        if isinstance(some, Mapping):
            chosen.update(some)
        elif isinstance(some, str):
            chosen[some] = some
        elif some is not None:
            chosen.update({column: column for column in some})
    return chosen


def _stamps(table: Mapping[str, Any]) -> str | None:
    """The column that is named like time stamps."""
    for name in table:
        plain = name.lower()
        if plain in ("time", "t", "timestamp", "stamp") or plain.startswith("time_"):
            return name
    return None


def _numbers(name: str, values: Any) -> NDArray[np.float64]:
    """A column as numbers; what is missing is ``nan``."""
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        try:
            array = np.array([np.nan if v is None or v != v else float(v) for v in values])
        except (TypeError, ValueError) as wrong:
            raise Error(f"column `{name}` is not of numbers: {wrong}") from wrong
    if array.ndim != 1:
        raise Error(f"column `{name}` has the shape {array.shape}, expected (rows,)")
    return array


def _runs(
    table: Mapping[str, Any],
    run: str | None,
    columns: Sequence[tuple[str, str | None, NDArray[np.float64]]],
) -> list[tuple[str, list[tuple[str, str | None, NDArray[np.float64]]]]]:
    """The columns, cut into runs."""
    if run is None:
        return [("", list(columns))]
    names, first, of = np.unique(np.asarray(table[run]), return_index=True, return_inverse=True)
    # The rows of each run in one go, as they were: all runs, however many, cost one sort.
    rows = np.argsort(of, kind="stable")
    ends = np.cumsum(np.bincount(of, minlength=len(names)))
    # In the order in which they begin.
    return [
        (
            str(names[k]),
            [(name, unit, values[rows[ends[k - 1] if k else 0 : ends[k]]]) for name, unit, values in columns],
        )
        for k in np.argsort(first)
    ]
