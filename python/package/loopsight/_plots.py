"""Pictures: measurement and model, and the residual below."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ._optional import needed

#: How each model is called, and its colour: that of the pages.
MODELS = {
    "model": ("model", "#d55e00"),
    "nominal": ("model as it is", "#d55e00"),
    "fitted": ("fitted model", "#0072b2"),
    "best": ("with what is missing", "#0072b2"),
}
MEASURED = "#555555"


def _rows(series: Sequence[dict[str, Any]]) -> dict[tuple[str, str, str], list[dict[str, Any]]]:
    """The series of each run and signal."""
    rows: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for one in series:
        rows.setdefault((one["run"], one["signal"], one["unit"]), []).append(one)
    return rows


def _title(run: str, signal: str, unit: str) -> str:
    return f"{signal}, {unit}" + (f" ({run})" if run else "")


def matplotlib(series: Sequence[dict[str, Any]], **options: Any) -> Any:
    """A figure of matplotlib."""
    plt = needed("pictures need", "matplotlib.pyplot")
    rows = _rows(series)
    options.setdefault("figsize", (9.0, 1.0 + 3.0 * max(len(rows), 1)))
    options.setdefault("gridspec_kw", {"height_ratios": [3, 1] * max(len(rows), 1)})
    figure, axes = plt.subplots(2 * max(len(rows), 1), 1, squeeze=False, layout="constrained", **options)
    for k, (key, models) in enumerate(rows.items()):
        above, below = axes[2 * k][0], axes[2 * k + 1][0]
        below.sharex(above)
        time = models[0]["time_s"]
        above.plot(time, models[0]["measured"], ".", ms=2, color=MEASURED, label="measured")
        for one in models:
            called, colour = MODELS.get(one["of"], (one["of"], "#009e73"))
            above.plot(time, one["model"], lw=1.2, color=colour, label=called)
            below.plot(time, one["residual"], lw=0.8, color=colour)
        above.set_ylabel(_title(*key))
        above.tick_params(labelbottom=False)
        above.legend(loc="upper right", fontsize="small")
        below.axhline(0.0, lw=0.5, color=MEASURED)
        below.set_ylabel("residual")
        if k + 1 == len(rows):
            below.set_xlabel("time, s")
    # A notebook shows the figure that is returned; open once is enough.
    plt.close(figure)
    return figure


def plotly(series: Sequence[dict[str, Any]], **options: Any) -> Any:
    """A figure of plotly."""
    make_subplots = needed("these pictures need", "plotly.subplots").make_subplots
    rows = _rows(series)
    count = max(len(rows), 1)
    options.setdefault("row_heights", [3.0, 1.0] * count)
    figure = make_subplots(rows=2 * count, cols=1, shared_xaxes=True, vertical_spacing=0.08 / count, **options)
    seen: set[str] = set()

    def draw(row: int, time: Any, values: Any, called: str, **how: Any) -> None:
        first = called not in seen
        seen.add(called)
        figure.add_scattergl(
            x=time, y=values, name=called, legendgroup=called, showlegend=first, row=row, col=1, **how
        )

    for k, (key, models) in enumerate(rows.items()):
        above, below = 2 * k + 1, 2 * k + 2
        time = models[0]["time_s"]
        dots = {"size": 3, "color": MEASURED}
        draw(above, time, models[0]["measured"], "measured", mode="markers", marker=dots)
        for one in models:
            called, colour = MODELS.get(one["of"], (one["of"], "#009e73"))
            draw(above, time, one["model"], called, mode="lines", line={"color": colour})
            draw(below, time, one["residual"], called, mode="lines", line={"color": colour})
        figure.update_yaxes(title_text=_title(*key), row=above, col=1)
        figure.update_yaxes(title_text="residual", row=below, col=1)
    figure.update_xaxes(title_text="time, s", row=2 * count, col=1)
    figure.update_layout(height=120 + 300 * count, margin={"t": 30})
    return figure
