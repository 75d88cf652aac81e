"""Small pictures of a fleet, as SVG that needs no script."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import Any

#: Size of a picture in a row of a table.
ROW = (190.0, 44.0)
#: Width of a picture of the whole fleet, and the height of a robot in it.
WIDE, HIGH = 420.0, 180.0
#: Free space at the edges.
EDGE = 6.0


def _scale(values: Sequence[float], low: float, high: float) -> tuple[float, float]:
    """Factor and offset that bring the values between two places."""
    least, most = min(values), max(values)
    if not most > least:
        return 0.0, 0.5 * (low + high)
    factor = (high - low) / (most - least)
    return factor, low - factor * least


def over_time(logs: Any, line: tuple[float, float]) -> str:
    """A robot's parameter over time: each log with two standard errors, and the line at the first and last log.

    `logs` has the rows of one robot and parameter of `readings`.
    """
    days, values, errors, wild = (logs[name].tolist() for name in ("day", "value", "std_error", "wild"))
    kept = [at for at, far in enumerate(wild) if not far]
    seen = [*line, *(values[at] + side * 2.0 * errors[at] for at in kept for side in (-1.0, 1.0))]
    across, first = _scale(days, EDGE, ROW[0] - EDGE)
    up, zero = _scale(seen, ROW[1] - EDGE, EDGE)
    parts = []

    def height(value: float) -> float:
        # A wild log stands at the edge.
        return min(max(up * value + zero, 3.0), ROW[1] - 3.0)

    for day, value, error, far in zip(days, values, errors, wild, strict=True):
        x = across * day + first
        mark = " marked" if far else ""
        ends = (height(value - 2.0 * error), height(value + 2.0 * error))
        parts.append(f'<path class="reach{mark}" d="M{x:.1f} {ends[0]:.1f}V{ends[1]:.1f}"/>')
        parts.append(f'<circle class="dot{mark}" cx="{x:.1f}" cy="{height(value):.1f}" r="2.5"/>')
    reached = [days[at] for at in kept]
    left, right = (across * day + first for day in (min(reached), max(reached)))
    parts.append(f'<path class="through" d="M{left:.1f} {height(line[0]):.1f}L{right:.1f} {height(line[1]):.1f}"/>')
    return f'<svg viewBox="0 0 {ROW[0]:g} {ROW[1]:g}" aria-hidden="true">{"".join(parts)}</svg>'


def side_by_side(of: Any, told: str) -> str:
    """Every robot beside its siblings: its value, where it could be by chance, and the middle of the fleet.

    `of` has the rows of one parameter of `siblings`; `told` says what the picture shows.

    The reach of those that are not marked is left out: the picture would be full of it.
    """
    robots, values, lows, highs, marked = (
        of[name].tolist() for name in ("robot", "value", "low", "high", "apart")
    )
    fleet = float(of["fleet"].iloc[0])
    order = sorted(range(len(values)), key=values.__getitem__)
    up, zero = _scale([*values, fleet], HIGH - EDGE, EDGE)
    step = (WIDE - 2.0 * EDGE) / max(len(order), 1)
    parts = [f'<path class="middle" d="M0 {up * fleet + zero:.1f}H{WIDE:g}"/>']
    for place, at in enumerate(order):
        x, y = EDGE + (place + 0.5) * step, up * values[at] + zero
        mark = " marked" if marked[at] else ""
        if mark and math.isfinite(lows[at]) and math.isfinite(highs[at]):
            half = 0.5 * abs(up * (highs[at] - lows[at]))
            ends = (max(y - half, 0.0), min(y + half, HIGH))
            parts.append(f'<path class="reach marked" d="M{x:.1f} {ends[0]:.1f}V{ends[1]:.1f}"/>')
        title = f"<title>{escape(robots[at])}</title>"
        parts.append(f'<circle class="dot{mark}" cx="{x:.1f}" cy="{y:.1f}" r="{3.5 if mark else 2.2}">{title}</circle>')
    label = escape(told, quote=True)
    return f'<svg viewBox="0 0 {WIDE:g} {HIGH:g}" role="img" aria-label="{label}">{"".join(parts)}</svg>'
