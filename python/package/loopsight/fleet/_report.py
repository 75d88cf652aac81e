"""The page of a fleet."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from .._engine import page_style
from .._files import whole
from . import _charts
from ._statistics import BY_CHANCE, RATE, apart, days, lines, missing, moving, read, readings

#: Rows of a table that the page shows; the data frames have them all.
ROWS = 400
#: Kinds of pictures of the whole fleet.
PICTURES = 24


def report(
    results: Any,
    out: str | PathLike[str] = "fleet.html",
    *,
    rate: float = RATE,
    title: str = "A fleet",
) -> Path:
    """Writes what the results of a fleet say on one page, which opens offline.

    Which robots lack which effect (`missing`), whose parameters move (`trends`), who is unlike its siblings
    (`siblings`), which logs are broken; with links to each log's own page where `improve` wrote one.

    Parameters
    ----------
    results : pandas data frame or path
        What `improve` found.
    out : path
        The page to write.
    rate : float
        The share of false alarms among what is marked, on average over the whole fleet (Benjamini and Hochberg), for
        each of the three questions.
    title : str
        The page's title.

    Returns
    -------
    pathlib.Path
        The page.
    """
    name = fspath(results) if isinstance(results, (str, PathLike)) else ""
    results = read(results)
    target = Path(fspath(out))
    said = _Said(results, rate, target)
    body = "".join((said.tiles(), said.robots(), said.lacking(), said.moving(), said.apart(), said.broken(),
                    said.wild(), said.every(), said.reckoned()))  # fmt: skip
    style = page_style() + files(__package__).joinpath("fleet.css").read_text(encoding="utf-8")
    table = f" · results <code>{escape(name)}</code>" if name else ""
    page = (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; style-src \'unsafe-inline\'; '
        "base-uri 'none'; form-action 'none'\">\n"
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n"
        f'<header><h1>{escape(title)}</h1><p class="about">{said.about()}{table}</p></header>\n{body}'
        "<footer>Made with <code>loopsight.fleet.report</code>.</footer>\n</main>\n</body>\n</html>\n"
    )
    with whole(target) as part:
        part.write_text(page, encoding="utf-8")
    return target


class _Said:
    """What there is to say, part by part."""

    def __init__(self, results: Any, rate: float, target: Path) -> None:
        self.results = results.assign(robot=results["robot"].astype(str), day=days(results))
        self.rate = rate
        self.folder = target.absolute().parent
        self.readings = readings(results)
        self.missing = missing(results, rate=rate)
        through = lines(self.readings)
        self.trends = moving(through, rate)
        self.siblings = apart(through, rate)
        self.lacks = self.missing[self.missing["lacks"]]
        self.moves = self.trends[self.trends["moves"]]
        self.unlike = self.siblings[self.siblings["apart"]]
        self.faulty = self.results[self.results["status"] != "done"]
        self.names = sorted(self.results["robot"].unique())

    def about(self) -> str:
        span = self.results["day"].max() - self.results["day"].min()
        over = f" over {span:.0f} days" if span > 0.0 else ""
        return f"{len(self.names)} robots · {len(self.results)} logs{over}"

    def tiles(self) -> str:
        numbers = [
            (self.lacks["robot"].nunique(), "robots lack an effect"),
            (self.moves["robot"].nunique(), "robots have a parameter that moves"),
            (self.unlike["robot"].nunique(), "robots are unlike their siblings"),
            (len(self.faulty), "logs are broken"),
        ]
        tiles = "".join(f"<div><b>{number}</b><span>{text}</span></div>" for number, text in numbers)
        note = (
            f"Of what is marked here, at most {100.0 * self.rate:g} % are false alarms on average, over the whole fleet and "
            "for each of the three questions (Benjamini and Hochberg). Intervals hold with 95 %, each for itself."
        )
        return f'<div class="tiles">{tiles}</div>\n<p class="what">{note}</p>\n'

    def robots(self) -> str:
        """The robots that need a look, those with the most to say first."""
        words: dict[str, list[list[str]]] = {}
        for at, table in enumerate((self.lacks, self.moves, self.unlike)):
            for row in table.to_dict("records"):
                text = str(row["effect"] if at == 0 else row["parameter"])
                if at == 1:
                    text += f" {_share(row['change'], row['value'])}"
                elif at == 2 and row["of"] == "slope":
                    text += " drifts"
                words.setdefault(row["robot"], [[], [], []])[at].append(text)
        order = sorted(words, key=lambda robot: (-sum(map(len, words[robot])), robot))
        rows = [[_robot(robot), *(_codes(one) for one in words[robot])] for robot in order]
        if not rows:
            return _section("Robots to look at", "No robot stands out.", "")
        what = f"{len(rows)} of {len(self.names)} robots, those with the most to say first."
        return _section("Robots to look at", what, _table(["robot", "lacks", "moves", "unlike its siblings"], rows))

    def lacking(self) -> str:
        what = (
            "An effect is missing from a robot's model where more of its logs name it than chance would: a log names an "
            f"effect that is not there at most in {100.0 * BY_CHANCE:g} % of cases (binomial test)."
        )
        if not len(self.lacks):
            return _section("Missing effects", "No robot lacks an effect. " + what, "")
        every = self.lacks.groupby("effect")["robot"].nunique().sort_values(ascending=False)
        head = _table(["effect", "#robots"], [[_code(effect), str(count)] for effect, count in every.items()])
        rows = [
            [_robot(row["robot"]), _code(row["effect"]), f"{row['found']} of {row['logs']}",
             f"{100 * row['low']:.0f} … {100 * row['high']:.0f} %", _q(row["q"])]
            for row in self.lacks.to_dict("records")
        ]  # fmt: skip
        body = _table(["robot", "effect", "#logs", "#95 % interval", "#q"], rows)
        return _section("Missing effects", what, head + body)

    def moving(self) -> str:
        what = (
            "A weighted line through each robot's logs. The scatter of the logs about it decides where it is more than "
            "their standard errors say, so a model that is wrong makes no more false alarms. Bars reach two standard "
            "errors of a log; a log in the colour of errors is set aside."
        )
        if not len(self.trends):
            return _section("Parameters that move", "It takes four good logs of a robot, with their times.", "")
        if not len(self.moves):
            return _section("Parameters that move", f"None of {len(self.trends)} moves. {what}", "")
        points = dict(list(self.readings.groupby(["robot", "parameter"])))
        rows = []
        for row in self.moves.head(ROWS).to_dict("records"):
            logs = points[(row["robot"], row["parameter"])].sort_values("day")
            kept = logs[~logs["wild"]]
            rows.append([
                _robot(row["robot"]), _code(row["parameter"]), _picture(row, logs, kept),
                _with_unit(row["change"], row["unit"])
                + f'<br><span class="soft">{_share(row["change"], row["value"])} in {row["days"]:.0f} days</span>',
                _interval(row["change_low"], row["change_high"]),
                _with_unit(7.0 * row["slope"], row["unit"]), _q(row["q"]),
            ])  # fmt: skip
        heads = ["robot", "parameter", "its logs", "#change", "#95 % interval", "#each week", "#q"]
        return _section("Parameters that move", what, _table(heads, rows, len(self.moves)))

    def apart(self) -> str:
        what = (
            "The deviation from the median of the fleet. Its interval holds the robot's own error and the spread "
            "between siblings. A slope is that of the line above, so a robot that ages like all others is not marked by it."
        )
        if not len(self.siblings):
            return _section("Unlike its siblings", "It takes five robots with the same parameter.", "")
        figures: list[str] = []
        for (parameter, of), one in self.siblings.groupby(["parameter", "of"]):
            if one["apart"].any() and len(figures) < PICTURES:
                told = f"{parameter} of every robot" if of == "level" else f"slope of {parameter}"
                chart = _charts.side_by_side(one, told)
                each = 7.0 if of == "slope" else 1.0
                ends = _interval(each * float(one["value"].min()), each * float(one["value"].max()))
                name = _code(parameter) + (" each week" if of == "slope" else "")
                unit = _shown(one["unit"].iloc[0])
                caption = f"{name}: {ends} {unit}; {int(one['apart'].sum())} of {len(one)} marked"
                figures.append(f"<figure>{chart}<figcaption>{caption}</figcaption></figure>")
        if not figures:
            return _section("Unlike its siblings", f"No robot is. {what}", "")
        rows = []
        for row in self.unlike.head(ROWS).to_dict("records"):
            slope = row["of"] == "slope"
            value, fleet, off, low, high, spread = (
                row[name] * (7.0 if slope else 1.0) for name in ("value", "fleet", "deviation", "low", "high", "spread")
            )
            rows.append([
                _robot(row["robot"]), _code(row["parameter"]) + (" each week" if slope else ""),
                _with_unit(value, row["unit"]), _number(fleet), _number(off), _interval(low, high), _number(spread),
                _q(row["q"]),
            ])  # fmt: skip
        heads = ["robot", "parameter", "#value", "#fleet", "#deviation", "#95 % interval", "#spread", "#q"]
        body = f'<div class="grid forces">{"".join(figures)}</div>{_table(heads, rows, len(self.unlike))}'
        return _section("Unlike its siblings", what, body)

    def broken(self) -> str:
        if not len(self.faulty):
            return ""
        rows = [
            [_robot(row["robot"]), escape(_text(row.get("time"))[:19]), _code(Path(row["path"]).name),
             escape(_text(row.get("fault")).replace(row["path"], Path(row["path"]).name)), self._link(row, "page")]
            for row in self.faulty.head(ROWS).to_dict("records")
        ]  # fmt: skip
        what = "They say nothing about their robots, and nothing above rests on them."
        body = _table(["robot", "time", "log", "fault", "page"], rows, len(self.faulty))
        return _section("Broken logs", what, f"<details><summary>{len(self.faulty)} logs</summary>{body}</details>")

    def wild(self) -> str:
        far = self.readings[self.readings["wild"]]
        if not len(far):
            return ""
        rows = [
            [_robot(row["robot"]), _code(Path(row["path"]).name), _code(row["parameter"]), _with_unit(row["value"], row["unit"])]
            for row in far.head(ROWS).to_dict("records")
        ]  # fmt: skip
        what = "A single log that is far off its robot's others. Lines and comparisons leave this parameter of it out."
        body = _table(["robot", "log", "parameter", "#value"], rows, len(far))
        return _section("Set aside", what, f"<details><summary>{len(far)} values</summary>{body}</details>")

    def every(self) -> str:
        """All robots, with their logs' pages."""
        rows = []
        groups = dict(list(self.results.sort_values("day").groupby("robot")))
        for robot in self.names[:ROWS]:
            logs = groups[robot].to_dict("records")
            good = sum(1 for row in logs if row["status"] == "done")
            links = "".join(self._link(row, str(at)) for at, row in enumerate(logs, start=1))
            anchor = f'<b id="{_anchor(robot)}">{escape(robot)}</b>'
            rows.append([anchor, str(len(logs)), str(good), f'<span class="links">{links}</span>'])
        body = _table(["robot", "#logs", "#good", "pages of its logs"], rows, len(self.names))
        return _section("Every robot", "", f"<details open><summary>{len(self.names)} robots</summary>{body}</details>")

    def reckoned(self) -> str:
        lines = [
            "q is p after Benjamini and Hochberg over all robots and parameters (or effects): marked is q of at most "
            f"{self.rate:g}.",
            "Slopes: least squares, each log by its standard error but none more than the middle log of the fleet; Student's "
            "distribution with two degrees of freedom less than logs.",
            "Siblings: the spread comes from the median deviation of the fleet, less what the errors explain; Student's "
            "distribution with the degrees of freedom after Welch and Satterthwaite. It takes siblings whose spread is about "
            "normal.",
            "Set aside is a log six spreads from the line through most of its robot's logs (Theil and Sen), at most one in five.",
            "The numbers of this page are data frames, too: fleet.missing, fleet.trends, fleet.siblings, fleet.readings.",
        ]
        return _section("How it is reckoned", "", "<ul>" + "".join(f"<li>{line}</li>" for line in lines) + "</ul>")

    def _link(self, row: dict[str, Any], text: str) -> str:
        page = row.get("page")
        if not isinstance(page, str) or not Path(page).is_file():
            return ""
        # A folder on another drive has no way there from here.
        try:
            way = Path(os.path.relpath(page, self.folder)).as_posix()
        except ValueError:
            way = Path(page).as_uri()
        return f'<a href="{escape(way, quote=True)}">{escape(text)}</a>'


def _picture(row: dict[str, Any], logs: Any, kept: Any) -> str:
    first, last = float(kept["day"].min()), float(kept["day"].max())
    # The line goes through the value at the middle of the logs by their weights; nearly that of their days.
    middle = float(kept["day"].mean())
    line = (row["value"] + row["slope"] * (first - middle), row["value"] + row["slope"] * (last - middle))
    return _charts.over_time(logs, line)


def _section(title: str, what: str, body: str) -> str:
    told = f'<p class="what">{escape(what)}</p>\n' if what else ""
    return f"<section>\n<h2>{escape(title)}</h2>\n{told}{body}</section>\n"


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]], of: int | None = None) -> str:
    """A table of HTML; a head that begins with # is one of numbers."""
    kinds = [' class="number"' if head.startswith("#") else "" for head in heads]
    head = "".join(f"<th{kind}>{escape(text.lstrip('#'))}</th>" for kind, text in zip(kinds, heads, strict=True))
    shown = list(rows)[:ROWS]
    body = "".join(
        "<tr>" + "".join(f"<td{kind}>{cell}</td>" for kind, cell in zip(kinds, row, strict=True)) + "</tr>" for row in shown
    )
    more = "" if of is None or of <= len(shown) else f'<p class="what">The first {len(shown)} of {of}.</p>'
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>{more}'


def _anchor(robot: str) -> str:
    return "robot-" + escape("".join(one if one.isalnum() else f"-{ord(one)}-" for one in robot), quote=True)


def _robot(robot: str) -> str:
    return f'<a href="#{_anchor(robot)}">{escape(robot)}</a>'


def _code(text: str) -> str:
    return f"<code>{escape(text)}</code>"


def _codes(texts: Iterable[str]) -> str:
    return "<br>".join(map(_code, texts))


def _text(value: Any) -> str:
    return value if isinstance(value, str) else "" if value is None or value != value else str(value)


def _number(value: float) -> str:
    digits, _, power = f"{value:.3g}".replace("-", "−").partition("e")
    return digits + (f"·10<sup>{power[0].strip('+')}{power[1:].lstrip('0')}</sup>" if power else "")


def _with_unit(value: float, unit: str) -> str:
    return f"{_number(value)} {_shown('' if unit == '1' else unit)}".rstrip()


def _shown(unit: str) -> str:
    return escape(unit.replace("^2", "²").replace("^3", "³"))


def _interval(low: float, high: float) -> str:
    return f"{_number(low)} … {_number(high)}"


def _share(change: float, value: float) -> str:
    """A change as a share of the value that it is of; as it is where that is about nothing."""
    if not math.isfinite(value) or abs(change) > 10.0 * abs(value):
        return _number(change)
    return f"{100.0 * change / abs(value):+.2g} %".replace("-", "−")


def _q(q: float) -> str:
    return "&lt; 0.0001" if q < 1e-4 else f"{q:.2g}"
