"""What a fleet's results say: their statistics on tables whose truth is known, and the page."""

from __future__ import annotations

import json
import math
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import loopsight as ls
import numpy as np
import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

ROOT = Path(__file__).resolve().parents[2]
HIDDEN = ROOT / "examples/hidden-effect/oscillator_coulomb_friction"


def table(
    seed: int,
    robots: int = 20,
    logs: int = 10,
    *,
    said: float = 1.0,
    drift: dict[int, float] | None = None,
    odd: dict[int, float] | None = None,
    wild: dict[int, int] | None = None,
) -> pandas.DataFrame:
    """Results as `improve` has them: siblings with a spread of 2, logs with one of 1, which say it is `said`.

    `drift` and `odd` say how far a robot's parameter moves and how far off it is; `wild`, which log of a robot is far
    off by itself.
    """
    rng = np.random.default_rng(seed)
    rows = []
    for robot in range(robots):
        own = 10.0 + 2.0 * rng.normal() + (odd or {}).get(robot, 0.0)
        for log in range(logs):
            value = own + rng.normal() + (drift or {}).get(robot, 0.0) * log / max(logs - 1, 1)
            value += 300.0 * ((wild or {}).get(robot) == log)
            told = {
                "gain": {"value": value, "unit": "V", "std_error": said, "verdict": "good"},
                "held": {"value": 1.0, "unit": "m", "std_error": None, "verdict": "held"},
            }
            rows.append({
                "robot": f"r{robot:02}", "time": str(pandas.Timestamp("2026-06-01") + pandas.Timedelta(weeks=log)),
                "path": f"r{robot:02}-{log}.csv", "status": "done", "fault": None, "effects": "",
                "parameters": json.dumps(told),
            })  # fmt: skip
    return pandas.DataFrame(rows)


@pytest.mark.parametrize("said", [1.0, 0.05], ids=["errors-are-right", "errors-are-too-small"])
def test_a_fleet_without_secrets_is_seldom_marked_and_intervals_hold(said: float) -> None:
    fleets = 24
    marked, holds, chance = np.zeros(2), [], []
    for seed in range(fleets):
        results = table(seed, said=said)
        moves, apart = ls.fleet.trends(results), ls.fleet.siblings(results)
        marked += (moves["moves"].any(), apart["apart"].any())
        holds.append(((moves["slope_low"] < 0.0) & (moves["slope_high"] > 0.0)).mean())
        chance.append((apart["p"] < 0.05).mean())
    # At a rate of 5 % one such fleet of 24 is marked; six or more come once in 1000 times.
    assert (marked <= 5).all()
    assert np.mean(holds) > 0.93 and np.mean(chance) < 0.07


def test_what_moves_and_who_is_apart_are_found() -> None:
    results = table(3, robots=30, drift={4: 12.0, 9: -12.0}, odd={17: 20.0}, said=0.1)
    moves = ls.fleet.trends(results)
    assert set(moves[moves["moves"]]["robot"]) == {"r04", "r09"}
    first = moves.set_index("robot").loc["r04"]
    assert first["change_low"] < 12.0 < first["change_high"] and first["days"] == 63.0
    assert first["slope"] == pytest.approx(first["change"] / 63.0)
    apart = ls.fleet.siblings(results)
    marked = set(apart[apart["apart"]][["robot", "of"]].itertuples(index=False, name=None))
    assert {("r17", "level"), ("r04", "slope"), ("r09", "slope")} <= marked
    assert not {robot for robot, _ in marked} - {"r04", "r09", "r17"}
    level = apart[(apart["robot"] == "r17") & (apart["of"] == "level")].iloc[0]
    assert 15.0 < level["deviation"] < 26.0 and level["low"] > 0.0
    assert 1.0 < level["spread"] < 3.5


def test_a_fleet_that_ages_as_one_has_no_odd_robot() -> None:
    results = table(5, drift=dict.fromkeys(range(20), 15.0))
    assert ls.fleet.trends(results)["moves"].all()
    assert not ls.fleet.siblings(results)["apart"].any()


@pytest.mark.parametrize("log", [0, 4, 9])
def test_one_wild_log_hides_nothing_and_marks_nobody(log: int) -> None:
    results = table(7, drift={4: 12.0}, wild={4: log, 5: log})
    far = ls.fleet.readings(results)
    assert set(far[far["wild"]]["path"]) == {f"r04-{log}.csv", f"r05-{log}.csv"}
    moves = ls.fleet.trends(results)
    assert set(moves[moves["moves"]]["robot"]) == {"r04"}
    assert moves.set_index("robot").loc["r04", "set_aside"] == 1
    assert "r05" not in set(ls.fleet.siblings(results).query("apart")["robot"])


def test_one_log_of_each_robot_and_no_times() -> None:
    results = table(1, robots=12, logs=1, odd={3: 60.0}, said=0.1)
    assert ls.fleet.trends(results).empty
    apart = ls.fleet.siblings(results)
    assert list(apart[apart["apart"]]["robot"]) == ["r03"] and set(apart["of"]) == {"level"}
    timeless = table(2).drop(columns="time")
    assert ls.fleet.trends(timeless).empty and len(ls.fleet.siblings(timeless)) == 20
    numbered = table(2).assign(time=[str(7 * (at % 10)) for at in range(200)])
    pandas.testing.assert_frame_equal(ls.fleet.trends(numbered), ls.fleet.trends(table(2)))
    assert ls.fleet.siblings(table(2, robots=4)).empty


def test_an_effect_counts_against_what_chance_names() -> None:
    results = table(1, robots=20, logs=10)
    effects = np.full(200, "", dtype=object)
    effects[30:40] = "backlash@shaft"  # every log of r03
    effects[[55, 72, 73]] = "dead_zone@input; backlash@shaft"
    found = ls.fleet.missing(results.assign(effects=effects))
    assert list(found[found["lacks"]][["robot", "effect"]].itertuples(index=False, name=None)) == [
        ("r03", "backlash@shaft")
    ]
    assert len(found) == 5 and set(found["found"]) == {10, 1, 2}
    row = found.iloc[0]
    assert row["share"] == 1.0 and row["low"] == pytest.approx(0.025**0.1) and row["high"] == 1.0


@settings(max_examples=20, deadline=None, derandomize=True)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["a", "b", "c", "d", "e", "f"]),
            st.floats(-1e9, 1e9),
            st.one_of(st.none(), st.floats(0.0, 1e6)),
            st.one_of(st.none(), st.dates(), st.text(max_size=3)),
            st.sampled_from(["done", "fault"]),
        ),
        max_size=40,
    )
)
def test_any_table_has_an_answer(rows: list[tuple[str, float, float | None, Any, str]]) -> None:
    results = pandas.DataFrame(
        [
            (robot, None if time is None else str(time), str(at), status, "",
             json.dumps({"k": {"value": value, "unit": "1", "std_error": error}}) if status == "done" else None)
            for at, (robot, value, error, time, status) in enumerate(rows)
        ],
        columns=["robot", "time", "path", "status", "effects", "parameters"],
    )  # fmt: skip
    for told in (ls.fleet.trends(results), ls.fleet.siblings(results)):
        assert ((told["p"] >= 0.0) & (told["p"] <= 1.0) & (told["q"] >= told["p"])).all()
    trends = ls.fleet.trends(results)
    assert ((trends["slope_low"] <= trends["slope"]) & (trends["slope"] <= trends["slope_high"])).all()


class Page(HTMLParser):
    """Collects what a page refers to, and checks that what opens closes."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.names: set[str] = set()
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = dict(attrs)
        self.names.add(told.get("id") or "")
        assert not {"src", "onclick"} & set(told) and tag not in ("script", "link", "img")
        if told.get("href"):
            self.links.append(str(told["href"]))
        if tag not in ("meta", "br", "path", "circle"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in ("path", "circle"):
            assert self.open.pop() == tag


def test_the_page_says_it_all_and_fetches_nothing(tmp_path: Path) -> None:
    results = table(3, robots=30, drift={4: 12.0}, odd={17: 30.0}, wild={5: 3})
    results.loc[results["robot"] == "r21", "effects"] = "backlash@shaft"
    nasty = "<b>&\"robot'"
    results.loc[results["robot"] == "r29", "robot"] = nasty
    broken = {"robot": nasty, "path": "x/<i>.csv", "status": "fault", "fault": "x/<i>.csv:2: no <number>"}
    results = pandas.concat([results, pandas.DataFrame([broken])], ignore_index=True)
    page = tmp_path / "fleet.html"
    assert ls.fleet.report(results, page, title="A <fleet>") == page
    text = page.read_text(encoding="utf-8")
    read = Page()
    read.feed(text)
    assert not read.open and "://" not in text and "<i>" not in text and "<b>&" not in text
    assert all(link[1:] in read.names for link in read.links)
    assert "30 robots · 301 logs over 63 days" in text and "&lt;i&gt;.csv:2: no &lt;number&gt;" in text
    for part in ("backlash@shaft", "10 of 10", "Benjamini", "<svg", "Set aside", "color-scheme"):
        assert part in text
    ls.fleet.report(results[results["status"] == "fault"], page)
    assert "No robot stands out" in page.read_text(encoding="utf-8")


def test_a_page_of_a_fleet_has_the_style_of_all_others() -> None:
    assert ls._engine.page_style() == (ROOT / "report/assets/page.css").read_text()


def test_each_log_has_its_page_and_says_what_it_cost(tmp_path: Path) -> None:
    log = ls.Log.read(HIDDEN / "mixed.csv").part(0, 1200)
    log.save(tmp_path / "good.csv")
    (tmp_path / "empty.csv").write_text("")
    logs = pandas.DataFrame({"robot": "r/1", "path": [str(tmp_path / "good.csv"), str(tmp_path / "empty.csv")]})
    found = ls.fleet.improve(
        logs, HIDDEN / "model.toml", out=tmp_path / "found.parquet", pages=tmp_path / "pages", engine="processes", workers=1
    )
    empty, good = found.sort_values("path").to_dict("records")
    assert good["cpu_seconds"] > 0.0 and (math.isnan(good["memory_mb"]) or 20.0 < good["memory_mb"] < 2000.0)
    # Each log has one processor: threads beside it would take the other workers' time.
    assert good["cpu_seconds"] < 1.2 * good["seconds"] + 0.1
    assert Path(good["page"]).parent == tmp_path / "pages" and "<svg" in Path(good["page"]).read_text(encoding="utf-8")
    assert not isinstance(empty["page"], str) and empty["status"] == "fault"
    ls.fleet.report(tmp_path / "found.parquet", tmp_path / "fleet.html")
    text = (tmp_path / "fleet.html").read_text(encoding="utf-8")
    assert ls._engine.page_style() in text
    assert f'href="pages/{Path(good["page"]).name}"' in text


def test_mistakes_of_a_report_are_named() -> None:
    for wrong, part in [
        (lambda: ls.fleet.trends("no.parquet"), "there is no table of results at no.parquet"),
        (lambda: ls.fleet.trends(pandas.DataFrame({"robot": []})), "no column `path`"),
        (lambda: ls.fleet.siblings(table(1), rate=5.0), "rate is 5.0, expected a share"),
        (lambda: ls.fleet.missing(table(1), by_chance=0.0), "by_chance is 0.0"),
    ]:
        with pytest.raises(ls.Error) as caught:
            wrong()
        assert part in str(caught.value)
