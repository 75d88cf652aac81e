"""What the results of a fleet say: effects that robots lack, parameters that move, robots unlike their siblings.

The tests and their distributions are those of `scipy.stats`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from os import PathLike, fspath
from pathlib import Path
from typing import Any, NamedTuple

from .._error import Error
from .._optional import needed

#: The share of false alarms among what is marked, on average, over the whole fleet.
RATE = 0.05
#: How often a log names an effect that is not there, at most.
BY_CHANCE = 0.05
#: Spreads from a robot's line beyond which a log is wild.
WILD = 6.0
#: Logs with a time that a line needs: two are left to say how they scatter.
LOGS_FOR_A_LINE = 4
#: A robot's logs of which one may be set aside as wild.
ASIDE = 5
#: Robots that a comparison of siblings needs.
SIBLINGS = 5
#: How well a median's deviation knows the spread of so many numbers, against their standard deviation.
EFFICIENCY = 0.37


def pandas_and_scipy() -> Any:
    """pandas, with what it needs for Parquet and the statistics."""
    return needed("what a fleet says needs", "pandas", "pyarrow", "scipy.stats")


def read(results: Any) -> Any:
    """The table of results, from a path or as it is."""
    pandas = needed("what a fleet says needs", "pandas", "pyarrow")
    if isinstance(results, (str, PathLike)):
        if not Path(fspath(results)).is_file():
            raise Error(f"there is no table of results at {fspath(results)}", file=fspath(results))
        results = pandas.read_parquet(results)
    for column in ("robot", "path", "status", "effects", "parameters"):
        if column not in results.columns:
            raise Error(f"the results have no column `{column}`: they come from `loopsight.fleet.improve`")
    return results


def days(results: Any) -> Any:
    """The time of each log in days, since the first where they are dates; `nan` where there is none."""
    pandas = pandas_and_scipy()
    if "time" not in results.columns:
        return pandas.Series(math.nan, index=results.index)
    numbers = pandas.to_numeric(results["time"], errors="coerce").astype(float)
    if numbers.notna().any():
        return numbers
    texts = results["time"].astype("string")
    dates = pandas.to_datetime(texts, errors="coerce", utc=True, format="mixed")
    return (dates - dates.min()) / pandas.Timedelta(days=1)


def readings(results: Any) -> Any:
    """Every fitted parameter of every good log.

    Parameters
    ----------
    results : pandas data frame or path
        What `improve` found.

    Returns
    -------
    pandas.DataFrame
        ``robot``, ``day``, ``path``, ``parameter``, ``unit``, ``value``, ``std_error``; ``wild``: the log is far
        off its robot's other logs, and is set aside by `trends` and `siblings`.
    """
    pandas = pandas_and_scipy()
    results = read(results)
    rows = []
    columns = ("robot", "path", "status", "parameters")
    for day, (robot, path, status, text) in zip(
        days(results), results[list(columns)].itertuples(index=False, name=None), strict=True
    ):
        if status != "done" or not isinstance(text, str):
            continue
        for name, told in json.loads(text).items():
            value, error = told.get("value"), told.get("std_error")
            if value is None or error is None or not math.isfinite(value) or not 0.0 <= error < math.inf:
                continue  # held, or not determined by the log
            rows.append((str(robot), float(day), path, name, told.get("unit") or "", float(value), float(error)))
    names = ["robot", "day", "path", "parameter", "unit", "value", "std_error"]
    table = pandas.DataFrame(rows, columns=names).astype({"day": float, "value": float, "std_error": float})
    table["wild"] = _wild(table)
    return table


def _lines(group: Any) -> Any:
    """How far each log lies from a line through most of them (Theil and Sen); from their median without times."""
    import numpy as np
    from scipy import stats

    day, value = group["day"].to_numpy(), group["value"].to_numpy()
    if len(value) >= LOGS_FOR_A_LINE and np.isfinite(day).all() and np.ptp(day) > 0.0:
        through = stats.theilslopes(value, day)
        # The median of what is left, not the line through both medians: it holds when a log at an end is wild.
        left = value - through.slope * day
        return left - np.median(left)
    return value - np.median(value)


def _wild(table: Any) -> Any:
    """Marks single logs that are far off: at most one in five of a robot's logs, or none."""
    import numpy as np
    from scipy import stats

    wild = np.zeros(len(table), dtype=bool)
    for _, one in table.groupby("parameter"):
        groups = [(group.index.to_numpy(), _lines(group)) for _, group in one.groupby("robot")]
        off = np.concatenate([left for _, left in groups if len(left) >= LOGS_FOR_A_LINE] or [np.zeros(0)])
        fleet = stats.median_abs_deviation(off, scale="normal") if len(off) else math.inf
        for index, left in groups:
            own = stats.median_abs_deviation(left, scale="normal")
            far = np.abs(left) > WILD * max(fleet, own)
            if 0 < far.sum() <= len(left) // ASIDE:
                wild[index[far]] = True
    return wild


class Fitted(NamedTuple):
    """A line through a robot's logs, at their middle; without times a mean. NaN where there is none."""

    logs: int
    aside: int
    unit: str
    period: float
    level: float
    level_error: float
    slope: float
    slope_error: float
    freedom: float


#: Robot, parameter, and the line through its logs.
Line = tuple[str, str, Fitted]


def lines(table: Any) -> list[Line]:
    """A line for each robot and parameter of `readings`.

    A log counts by its standard error, but none more than the middle log of the fleet. How the logs scatter about
    the line decides where that is more than their standard errors say.
    """
    import numpy as np

    middle = table.groupby("parameter")["std_error"].transform("median").to_numpy()
    sigma = np.maximum(table["std_error"].to_numpy(), middle)
    tiny = np.finfo(float).tiny ** 0.25 + 1e-12 * np.abs(table["value"].to_numpy())
    table = table.assign(sigma=np.maximum(sigma, tiny))
    found: list[Line] = []
    for (robot, parameter), group in table.groupby(["robot", "parameter"], sort=True):
        kept = group[~group["wild"]]
        value, weight, day = (kept[name].to_numpy(dtype=float) for name in ("value", "sigma", "day"))
        weight = 1.0 / weight**2
        logs = len(value)
        period = slope = slope_error = math.nan
        level = float(np.average(value, weights=weight))
        left, freedom = value - level, logs - 1
        if logs >= LOGS_FOR_A_LINE and np.isfinite(day).all() and np.ptp(day) > 0.0:
            off = day - np.average(day, weights=weight)
            turning = float(np.sum(weight * off**2))
            period, slope = float(np.ptp(day)), float(np.sum(weight * off * value) / turning)
            left, freedom = left - slope * off, logs - 2
            slope_error = turning**-0.5
        scatter = math.sqrt(max(1.0, float(np.sum(weight * left**2)) / freedom)) if freedom else 1.0
        level_error = scatter * float(np.sum(weight)) ** -0.5
        line = Fitted(
            logs, len(group) - logs, kept["unit"].iloc[0], period, level, level_error, slope,
            scatter * slope_error, float(freedom),
        )  # fmt: skip
        found.append((str(robot), str(parameter), line))
    return found


def _judged(table: Any, rate: float, mark: str) -> Any:
    """Adds ``q``, p over the whole fleet after Benjamini and Hochberg, and whether it is at most `rate`."""
    from scipy import stats

    if not 0.0 < rate < 1.0:
        raise Error(f"rate is {rate}, expected a share between 0 and 1")
    table["q"] = stats.false_discovery_control(table["p"], method="bh") if len(table) else table["p"]
    table[mark] = table["q"] <= rate
    return table.sort_values(["q", "p", "robot"], ignore_index=True, kind="stable")


def _two_sided(statistic: float, freedom: float) -> tuple[float, float]:
    """p of a statistic after Student, and how many errors an interval of 95 % reaches."""
    from scipy import stats

    return float(2.0 * stats.t.sf(abs(statistic), freedom)), float(stats.t.ppf(0.975, freedom))


def trends(results: Any, *, rate: float = RATE) -> Any:
    """How parameters move over time.

    A weighted line through the logs of each robot. The interval is after Student with the scatter of the logs
    about the line where that is more than their standard errors say, as it is with a model that is wrong. Single
    wild logs are set aside (`readings`).

    Parameters
    ----------
    results : pandas data frame or path
        What `improve` found. ``time`` is a date, or a number of days.
    rate : float
        The share of false alarms among what is marked, on average over the whole fleet (Benjamini and Hochberg).

    Returns
    -------
    pandas.DataFrame
        A row for each robot and parameter with at least four logs, the surest first: ``robot``, ``parameter``,
        ``unit``, ``logs``, ``set_aside``, ``days`` from the first to the last log, ``value`` at their middle,
        ``slope`` per day with ``slope_low``, ``slope_high`` (95 %), ``change`` over these days with ``change_low``,
        ``change_high``; ``p``, ``q``, and whether it ``moves``.
    """
    return moving(lines(readings(results)), rate)


def moving(through: Iterable[Line], rate: float) -> Any:
    """`trends` of lines."""
    pandas = pandas_and_scipy()
    rows = []
    for robot, parameter, fit in through:
        if not fit.slope_error > 0.0:
            continue
        p, reach = _two_sided(fit.slope / fit.slope_error, fit.freedom)
        slopes = [fit.slope, fit.slope - reach * fit.slope_error, fit.slope + reach * fit.slope_error]
        rows.append(
            [robot, parameter, fit.unit, fit.logs, fit.aside, fit.period, fit.level, *slopes,
             *(fit.period * slope for slope in slopes), p]
        )  # fmt: skip
    names = ["robot", "parameter", "unit", "logs", "set_aside", "days", "value", "slope", "slope_low", "slope_high",
             "change", "change_low", "change_high", "p"]  # fmt: skip
    return _judged(pandas.DataFrame(rows, columns=names), rate, "moves")


def siblings(results: Any, *, rate: float = RATE) -> Any:
    """Which robots are unlike their siblings, or drift away from them.

    The deviation of a robot's parameter, and of its slope, from the median of the fleet. The interval holds the
    robot's own error and the spread between its siblings, which is found from their median deviation, so that few
    odd ones do not widen it.

    Parameters
    ----------
    results, rate
        As for `trends`.

    Returns
    -------
    pandas.DataFrame
        A row for each robot and parameter that at least five robots have, the surest first: ``robot``,
        ``parameter``, ``unit``, ``of`` (``level`` or ``slope`` per day), ``logs``, ``value``, ``fleet`` (the median),
        ``spread`` between siblings (one standard deviation), ``deviation`` with ``low``, ``high`` (95 %); ``p``,
        ``q``, and whether it is ``apart``.
    """
    return apart(lines(readings(results)), rate)


def apart(through: Iterable[Line], rate: float) -> Any:
    """`siblings` of lines."""
    pandas = pandas_and_scipy()
    groups: dict[tuple[str, str], list[tuple[str, Fitted]]] = {}
    for robot, parameter, fit in through:
        groups.setdefault((parameter, "level"), []).append((robot, fit))
        if fit.slope_error > 0.0:
            groups.setdefault((parameter, "slope"), []).append((robot, fit))
    rows = [row for (parameter, of), fits in groups.items() for row in _beside_siblings(parameter, of, fits)]
    names = ["robot", "parameter", "unit", "of", "logs", "value", "fleet", "spread", "deviation", "low", "high", "p"]
    return _judged(pandas.DataFrame(rows, columns=names), rate, "apart")


def _beside_siblings(parameter: str, of: str, fits: list[tuple[str, Fitted]]) -> Iterator[list[Any]]:
    """The rows of one parameter."""
    import numpy as np
    from scipy import stats

    if len(fits) < SIBLINGS:
        return
    level = of == "level"
    value = np.array([fit.level if level else fit.slope for _, fit in fits])
    error = np.array([fit.level_error if level else fit.slope_error for _, fit in fits])
    fleet = float(np.median(value))
    seen = float(stats.median_abs_deviation(value, scale="normal")) ** 2
    # What is seen is the spread between siblings and their errors; the fleet's median has an error, too.
    spread = max(0.0, seen - float(np.median(error**2)))
    known = EFFICIENCY * (len(fits) - 1)
    median = math.pi / 2.0 * seen / len(fits)
    for (robot, fit), here, own in zip(fits, value, error, strict=True):
        variance = spread + median + own**2
        if not variance > 0.0:
            continue
        freedom = variance**2 / ((spread + median) ** 2 / known + own**4 / max(fit.freedom, 1.0))
        off = float(here) - fleet
        p, reach = _two_sided(off / math.sqrt(variance), freedom)
        reach *= math.sqrt(variance)
        yield [robot, parameter, fit.unit, of, fit.logs, float(here), fleet, math.sqrt(spread),
               off, off - reach, off + reach, p]  # fmt: skip


def _named(text: Any) -> set[str]:
    """The effects that a log named."""
    return set(filter(None, text.split("; "))) if isinstance(text, str) else set()


def effects(results: Any) -> Any:
    """Which robots lack which effect: a table of robots and effects with the share of each robot's good logs.

    Parameters
    ----------
    results : pandas data frame or path
        What `improve` found.

    Returns
    -------
    pandas.DataFrame
        Indexed by robot: ``logs``, ``faults``, and a column for each ``effect@channel`` with a share from 0 to 1.
    """
    results = read(results)
    pandas = needed("what a fleet says needs", "pandas")
    rows = {}
    for robot, logs in results.groupby("robot", sort=True):
        good = logs[logs["status"] == "done"]
        row: dict[str, Any] = {"logs": len(logs), "faults": len(logs) - len(good)}
        for text in good["effects"]:
            for effect in _named(text):
                row[effect] = row.get(effect, 0.0) + 1.0 / len(good)
        rows[robot] = row
    table = pandas.DataFrame.from_dict(rows, orient="index").fillna(0.0)
    table.index.name = "robot"
    return table


def missing(results: Any, *, rate: float = RATE, by_chance: float = BY_CHANCE) -> Any:
    """Which robots lack which effect.

    Against what chance would name: an effect that is not there, in `by_chance` of the logs (binomial test).

    Parameters
    ----------
    results, rate
        As for `trends`.
    by_chance : float
        The share of a robot's logs that name an effect which is not there, at most.

    Returns
    -------
    pandas.DataFrame
        A row for each robot and effect that one of its logs named, the surest first: ``robot``, ``effect``
        (``effect@channel``), ``logs`` that were good, ``found`` in so many, ``share`` with ``low``, ``high`` (95 %,
        Clopper and Pearson); ``p``, ``q``, and whether the robot's model ``lacks`` it.
    """
    from scipy import stats

    pandas = pandas_and_scipy()
    if not 0.0 < by_chance < 1.0:
        raise Error(f"by_chance is {by_chance}, expected a share between 0 and 1")
    results = read(results)
    good = results[results["status"] == "done"]
    counts: dict[str, dict[str, int]] = {}
    logs: dict[str, int] = {}
    for robot, text in zip(good["robot"].astype(str), good["effects"], strict=True):
        logs[robot] = logs.get(robot, 0) + 1
        for effect in _named(text):
            of = counts.setdefault(effect, {})
            of[robot] = of.get(robot, 0) + 1
    rows = []
    # Robots in which none was found count, too: they were looked at.
    for effect, of in sorted(counts.items()):
        for robot, n in sorted(logs.items()):
            found = of.get(robot, 0)
            test = stats.binomtest(found, n, by_chance, alternative="greater")
            between = stats.binomtest(found, n).proportion_ci(0.95)
            rows.append([robot, effect, n, found, found / n, float(between.low), float(between.high), test.pvalue])
    names = ["robot", "effect", "logs", "found", "share", "low", "high", "p"]
    table = _judged(pandas.DataFrame(rows, columns=names), rate, "lacks")
    return table[table["found"] > 0].reset_index(drop=True)
