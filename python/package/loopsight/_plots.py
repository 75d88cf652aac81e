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
MEASURED, INK, GRID = "#555555", "#333333", "#e4e6ea"


def _rows(series: Sequence[dict[str, Any]]) -> dict[tuple[str, str, str], list[dict[str, Any]]]:
    """The series of each run and signal."""
    rows: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for one in series:
        rows.setdefault((one["run"], one["signal"], one["unit"]), []).append(one)
    return rows


def _title(run: str, signal: str, unit: str) -> str:
    return f"{signal}, {unit}" + (f" ({run})" if run else "")


def _taken(one: dict[str, Any]) -> tuple[Any, Any]:
    """The samples that were measured: between them a signal may have none."""
    import numpy as np

    there = np.isfinite(one["measured"])
    return one["time_s"][there], one["measured"][there]


def _plain(axes: Any, title: str, last: bool) -> None:
    """Axes as on the pages: the name above, a light grid, no frame."""
    axes.set_title(title, loc="left", fontsize="small", color=INK)
    axes.grid(color=GRID, lw=0.8)
    axes.set_axisbelow(True)
    axes.axhline(0.0, lw=0.8, color="#b5b9c0", zorder=1)
    axes.margins(x=0.0)
    axes.spines[:].set_visible(False)
    axes.spines["bottom"].set(visible=last, color="#b5b9c0")
    axes.tick_params(length=0, labelsize="small", labelcolor=INK, labelbottom=last)


def matplotlib(series: Sequence[dict[str, Any]], **options: Any) -> Any:
    """A figure of matplotlib."""
    plt = needed("pictures need", "matplotlib.pyplot")
    rows = _rows(series)
    count = max(len(rows), 1)
    options.setdefault("figsize", (9.0, 1.0 + 3.0 * count))
    options.setdefault("gridspec_kw", {"height_ratios": [3, 1.5] * count})
    figure, axes = plt.subplots(2 * count, 1, squeeze=False, layout="constrained", **options)
    lines: dict[str, Any] = {}
    for k, (key, models) in enumerate(rows.items()):
        above, below = axes[2 * k][0], axes[2 * k + 1][0]
        below.sharex(above)
        # A broad line below the others shows how near they come to it.
        (lines["measured"],) = above.plot(*_taken(models[0]), lw=3.2, alpha=0.45, color=MEASURED)
        for one in models:
            called, colour = MODELS.get(one["of"], (one["of"], "#009e73"))
            (lines[called],) = above.plot(one["time_s"], one["model"], lw=1.2, color=colour)
            below.plot(one["time_s"], one["residual"], lw=1.0, color=colour)
        _plain(above, _title(*key), False)
        _plain(below, f"residual of {_title(*key)}", k + 1 == count)
        if k + 1 == count:
            below.set_xlabel("time, s", color=INK, fontsize="small")
    figure.legend(
        lines.values(), lines, loc="outside upper left", ncols=4, frameon=False, fontsize="small", labelcolor=INK
    )
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
        broad = {"color": MEASURED, "width": 4}
        draw(above, *_taken(models[0]), "measured", mode="lines", line=broad, opacity=0.45)
        for one in models:
            called, colour = MODELS.get(one["of"], (one["of"], "#009e73"))
            thin = {"color": colour, "width": 1.5}
            draw(above, one["time_s"], one["model"], called, mode="lines", line=thin)
            draw(below, one["time_s"], one["residual"], called, mode="lines", line=thin)
        figure.update_yaxes(title_text=_title(*key), row=above, col=1)
        figure.update_yaxes(title_text="residual", row=below, col=1)
    figure.update_xaxes(gridcolor=GRID, zeroline=False)
    figure.update_yaxes(gridcolor=GRID, zerolinecolor="#b5b9c0")
    figure.update_xaxes(title_text="time, s", row=2 * count, col=1)
    above_all = {"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom"}
    figure.update_layout(
        height=120 + 300 * count, margin={"t": 40}, plot_bgcolor="white", legend=above_all, font_color=INK
    )
    return figure
