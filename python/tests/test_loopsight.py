"""The package as its users call it."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import loopsight as ls
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

ROOT = Path(__file__).resolve().parents[2]
HIDDEN = ROOT / "examples/hidden-effect/oscillator_coulomb_friction"
MODEL, LOG, OTHER = HIDDEN / "model.toml", HIDDEN / "mixed.csv", HIDDEN / "multi_level.csv"


@pytest.fixture(scope="module")
def improved() -> ls.Improvement:
    return ls.improve(MODEL, LOG, test=OTHER, report=OTHER)


def test_ten_lines_from_files_to_a_better_model(improved: ls.Improvement, tmp_path: Path) -> None:
    before = ls.compare(MODEL, LOG)
    found = ls.diagnose(MODEL, LOG)
    assert found.verdict == "effect_missing"
    assert found.missing.effect == "coulomb_friction" and found.missing.at == ["mass"]
    better = improved.model
    assert better is not None and better.effects == [("coulomb_friction", ["mass"])]
    level = improved.parameters["coulomb_friction.level"].value
    assert level == pytest.approx(0.25, rel=0.01), "what the recording hides: truth.toml"
    better.save(tmp_path / "better.toml")
    after = ls.compare(tmp_path / "better.toml", LOG)
    assert after.nrmse < 0.1 * before.nrmse
    reported = improved.to_dict()["reported"]
    assert reported["log"].endswith("multi_level.csv")
    assert reported["nrmse"] == pytest.approx(ls.compare(better, OTHER).nrmse, rel=1e-3)


def test_models_and_logs_are_paths_objects_or_frames() -> None:
    by_path = ls.compare(str(MODEL), str(LOG)).to_dict()
    log = ls.Log.read(LOG)
    by_object = ls.compare(ls.Model.from_file(MODEL), log).to_dict()
    by_frame = ls.compare(MODEL, log.to_dict()).to_dict()
    assert by_path == by_object == by_frame
    session = ls.Session(MODEL, LOG, also=[OTHER], test=OTHER)
    assert session.model.plant == "oscillator" and session.faults == []


@pytest.mark.parametrize("kind", ["dict", "pandas", "polars", "arrow"])
def test_every_kind_of_frame_is_the_same_log(kind: str) -> None:
    arrays = {
        "t": np.arange(4) * 0.5,
        "u": np.array([0, 6, 6, 0]),
        "speed_rpm": np.array([0.0, 12.0, math.nan, 20.0]),
        "note": ["a", "b", "c", "d"],
    }
    frame = {
        "dict": lambda: arrays,
        "pandas": lambda: __import__("pandas").DataFrame(arrays),
        "polars": lambda: __import__("polars").DataFrame(arrays),
        "arrow": lambda: __import__("pyarrow").table(arrays),
    }[kind]()
    log = ls.Log.from_frame(frame, units={"u": "V"}, time="t")
    assert log.columns == ["time_s", "u_V", "speed_rpm"], "texts are left out"
    assert log.rows == 4 and log.runs == 1
    assert log["u_V"].tolist() == [0.0, 6.0, 6.0, 0.0]
    assert np.isnan(log["speed_rpm"][2]) and log["speed_rpm"][3] == 20.0
    named = ls.Log.from_frame(frame, units={"u": "V"}, inputs={"voltage": "u"}, outputs=["speed_rpm"])
    assert named.columns == ["time_s", "voltage_V", "speed_rpm"]


class Stream:
    """What has Arrow's PyCapsule interface, and nothing else."""

    def __init__(self, table: object) -> None:
        self.table = table

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self.table.__arrow_c_stream__(requested_schema)  # type: ignore[attr-defined]


def test_dates_runs_and_streams() -> None:
    import pandas
    import pyarrow

    frame = pandas.DataFrame(
        {
            "timestamp": pandas.date_range("2026-01-01", periods=4, freq="250ms"),
            "day": ["b", "a", "b", "a"],
            "speed": pandas.array([1, None, 3, 4], dtype="Int64"),
        }
    )
    log = ls.Log.from_frame(frame, units={"speed": "rad/s"}, run="day")
    # The runs in the order in which they begin, each with its rows in theirs.
    assert log.runs == 2 and log["time_s"].tolist() == [0.0, 0.5, 0.25, 0.75]
    assert np.isnan(log["speed_rad_per_s"][2])
    stream = Stream(pyarrow.table({"time": [0.0, 1.0], "u_V": [1.0, 2.0]}))
    assert ls.Log.from_frame(stream).columns == ["time_s", "u_V"]


@given(
    rows=st.lists(
        st.tuples(st.floats(-1e9, 1e9), st.one_of(st.floats(-1e9, 1e9), st.just(math.nan))),
        min_size=1,
        max_size=40,
    )
)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_what_goes_in_comes_out_also_through_a_file(
    rows: list[tuple[float, float]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    u, y = np.array(rows).T
    log = ls.Log.from_frame({"time": np.arange(len(rows)) * 0.01, "u_V": u, "y_m": y})
    np.testing.assert_array_equal(log["u_V"], u)
    np.testing.assert_array_equal(log["y_m"], y)
    path = tmp_path_factory.mktemp("round") / "log.csv"
    log.save(path)
    back = ls.Log.read(path)
    assert back.columns == log.columns
    np.testing.assert_array_equal(back["u_V"], u)
    np.testing.assert_array_equal(back["y_m"], y)


@pytest.mark.parametrize(
    ("wrong", "part"),
    [
        (lambda: ls.Log.from_frame({"u_V": [1.0]}), "no column of time stamps"),
        (lambda: ls.Log.from_frame({"time": [0.0], "u": [1.0]}, units={"v": "V"}), "no column `v`"),
        (lambda: ls.Log.from_frame({"time": [0.0], "u": [1.0]}, units={"u": "Volx"}), "not a unit"),
        (lambda: ls.Log.from_frame({"time": [0.0], "u": ["x"]}, units={"u": "V"}), "not of numbers"),
        (lambda: ls.Log.from_frame({"time": [0.0], "u": [[1.0, 2.0]]}), "shape (1, 2)"),
        (lambda: ls.Log.from_frame(3), "found int"),
        (lambda: ls.Log.read(LOG)["speed"], "no column `speed`"),
        (lambda: ls.Model.from_plant("dc_axes"), "did you mean `dc_axis`?"),
        (lambda: ls.Session(None), "neither a model nor a log"),
        (lambda: ls.compare(MODEL), "there is no log"),
        (lambda: ls.fit(MODEL, LOG, method="newton"), "expected `output-error` or `rls`"),
        (lambda: ls.experiment(MODEL, pin="mass", is_there="backlash"), "answers one question"),
        (lambda: ls.parts("wheel"), "expected one of plant, effect"),
        (lambda: ls.parts("driver", plant="ddmr"), "only effects"),
        (lambda: ls.parts(plant="ddrm"), "did you mean `ddmr`?"),
        (lambda: ls.simulate(MODEL), "a file, or a text"),
    ],
)
def test_mistakes_are_named(wrong: object, part: str) -> None:
    with pytest.raises(ls.Error) as caught:
        wrong()  # type: ignore[operator]
    assert part in str(caught.value)


def test_an_error_has_its_place() -> None:
    with pytest.raises(ls.Error) as caught:
        ls.Model.from_toml("[plant.ddmr]\nhalf_trak = 0.1\n", "robot.toml")
    error = caught.value
    assert (error.file, error.line, error.column) == ("robot.toml", 2, 1)
    assert error.help == "did you mean `half_track`?" and error.excerpt == "half_trak = 0.1"
    assert error.exit_status == 2


def test_parts_explain_themselves() -> None:
    assert "oscillator" in [part.id for part in ls.parts("plant").parts]
    fitting = {part.id: part.at for part in ls.parts(plant="dc_axis").parts}
    assert fitting["coulomb_friction"] == ["shaft", "load"] and "scrub_friction" not in fitting
    assert "mistake" in str(ls.check(HIDDEN / "truth.toml")) and "oscillator" in str(ls.check(MODEL))
    assert ls.explain("coulomb_friction").to_dict()["schema"].startswith("loopsight/explain/")
    assert ls.check(MODEL).to_dict()["schema"].startswith("loopsight/check/")
    bare = ls.Log.from_bytes(b"u_V,speed_rpm\n" + b"6,1.5\n5,2.5\n" * 20, "bare.csv")
    assert "period_s = 0.02" in ls.inspect(bare, period_s=0.02).model_toml
    told = ls.inspect(LOG).to_dict()
    assert told["plants"] and told["channels"]


def test_a_plan_and_a_simulated_robot() -> None:
    model = ls.Model.from_file(MODEL)
    plan = ls.experiment(model, pin="mass", limit=5.0)
    assert plan.log is not None and plan.log.columns == ["time_s", "force_N"]
    assert np.abs(plan.log["force_N"]).max() <= 5.0
    robot = model.with_value("mass", 3.0)
    drive = 'duration_s = 8.0\nperiod_s = 0.01\n[inputs]\nforce = { prbs = { amplitude = 5.0, hold_s = 0.2, seed = 1 } }\n'
    made = ls.simulate(robot, toml=drive).log
    assert made is not None and made.rows == 801
    found = ls.fit(model, made)
    assert found.parameters["mass"].value == pytest.approx(3.0, rel=1e-3)
    with_friction = model.add("coulomb_friction", "mass")
    assert with_friction.effects == [("coulomb_friction", ["mass"])]


@ls.effect("mass", name="dry", level=ls.Free(0.1, "N", range=(0.0, 10.0)), width=ls.Free(1e-3, "m/s", held=True))
def dry(flow: object, level: object, width: object) -> object:
    """Dry friction."""
    return -level * np.tanh(flow / width)  # type: ignore[operator, call-overload]


def test_a_function_is_an_effect() -> None:
    assert dry.force == "((-level) * tanh((flow / width)))"
    assert dry(0.0, 1.0, 1e-3) == 0.0, "still a function of numbers"
    model = ls.Model.from_file(MODEL).with_effect(dry)
    assert model.effects == [("dry", ["mass"])]
    found = ls.fit(model, LOG)
    assert found.parameters["dry.level"].value == pytest.approx(0.25, rel=0.02)
    assert found.nrmse < 0.02


def test_a_function_is_tried_by_a_diagnosis() -> None:
    plain = ls.Model.from_file(MODEL)
    stronger = ls.Effect(lambda flow, c: -c * flow * abs(flow) ** 3, ["mass"], "air", {"c": ls.Free(0.1, "N s^4/m^4")})
    both = plain.with_candidate(dry).with_candidate(stronger)
    assert both.effects == [], "they are not in the model"
    assert ls.compare(both, LOG).nrmse == ls.compare(plain, LOG).nrmse
    found = ls.diagnose(both, LOG)
    names = {candidate.effect for candidate in found.candidates}
    assert names & {"dry", "coulomb_friction"}, names


@given(
    values=st.tuples(*[st.floats(0.1, 3.0)] * 2),
    steps=st.lists(st.sampled_from("+-*/^mxtsa"), min_size=1, max_size=6),
)
@settings(max_examples=40, deadline=None, derandomize=True)
def test_a_traced_function_computes_what_python_computes(
    values: tuple[float, float], steps: list[str]
) -> None:
    def formula(a, b):  # type: ignore[no-untyped-def]
        for step in steps:
            a = {
                "+": lambda a: a + 0.5 * b,
                "-": lambda a: -a - b,
                "*": lambda a: 1.5 * a * b,
                "/": lambda a: a / (2.0 + b**2),
                "^": lambda a: np.abs(a) ** 1.5,
                "m": lambda a: np.minimum(a, b),
                "x": lambda a: np.maximum(-1, a),
                "t": lambda a: np.tanh(a),
                "s": lambda a: np.sign(a) * np.sqrt(np.abs(a)),
                "a": lambda a: np.arctan2(a, b),
            }[step](a)
        return a + 0 * b  # the engine refuses a parameter that nothing uses

    traced = ls.Effect(formula, ["effort.x"], "formula", {})
    # The engine computes it as the output of a plant at rest.
    a, b = values
    plant = f'''
[plant.expression.states]
x = {{ unit = "1", rate = "0 * x" }}
[plant.expression.inputs]
u = {{ unit = "1" }}
[plant.expression.outputs]
y = {{ unit = "1", value = "{traced.force}" }}
[plant.expression.parameters]
a = {a!r}
b = {b!r}
[log.measured.y]
'''
    made = ls.simulate(ls.Model.from_toml(plant), toml="duration_s = 0.02\nperiod_s = 0.01\n").log
    assert made is not None
    np.testing.assert_allclose(made["y"][0], formula(a, b), rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize(
    ("wrong", "part"),
    [
        (lambda x: x if x > 0 else -x, "numpy.greater"),
        (lambda x: math.tanh(x), "in place of those of `math`"),
        (lambda x: np.cbrt(x), "has no `numpy.cbrt`"),
        (lambda x: "x", "cannot have a str"),
        (lambda x: x * math.inf, "cannot have the number inf"),
    ],
)
def test_what_cannot_be_traced_is_said(wrong: object, part: str) -> None:
    with pytest.raises(ls.Error) as caught:
        ls.effect("mass")(wrong)  # type: ignore[arg-type]
    assert part in str(caught.value)


def test_a_loop_runs() -> None:
    ran = ls.run(ROOT / "examples/twil/loop.toml", log=False)
    assert ran.ticks == 4500 and not ran.failed


def test_frames_and_pictures(improved: ls.Improvement, tmp_path: Path) -> None:
    parameters = improved.parameters_frame()
    assert parameters.loc["mass", "unit"] == "kg" and parameters.loc["mass", "verdict"] == "good"
    assert list(improved.steps_frame()["added"])[1] == "coulomb_friction"
    series = improved.series_frame()
    assert set(series["of"]) == {"nominal", "best"}
    rms = {of: float(np.sqrt((rows["residual"] ** 2).mean())) for of, rows in series.groupby("of")}
    assert rms["best"] < 0.2 * rms["nominal"]
    assert len(improved.plot().axes) == 2
    assert len(improved.plot("plotly").data) == 5
    with pytest.raises(ls.Error, match="expected `matplotlib` or `plotly`"):
        improved.plot("gnuplot")
    page = improved.report(tmp_path / "page.html").read_text(encoding="utf-8")
    assert "coulomb_friction" in page and "loopsight.improve" in page
    assert "coulomb_friction.level" in improved._repr_html_()
    found = ls.diagnose(MODEL, LOG).candidates_frame()
    assert found.loc[0, "effect"] == "coulomb_friction"


def test_attributes_are_the_keys(improved: ls.Improvement) -> None:
    assert improved.schema == improved.to_dict()["schema"]
    assert "verdict" in dir(improved) and "verdict" in dir(improved.parameters.mass)
    with pytest.raises(AttributeError, match="expected one of"):
        improved.verdickt


def test_progress_reaches_a_callable_and_its_exception_stops_the_work() -> None:
    seen: list[tuple[str, int, int]] = []
    ls.diagnose(MODEL, LOG, progress=lambda *now: seen.append(now))
    assert seen and all(0 <= done <= total for _, done, total in seen)

    def stop(*_: object) -> None:
        raise ValueError("enough")

    with pytest.raises(ValueError, match="enough"):
        ls.improve(MODEL, LOG, progress=stop)


def test_what_is_known_early_is_told_in_order() -> None:
    told: list[dict[str, Any]] = []
    found = ls.improve(MODEL, LOG, early=told.append)
    kinds = [known["finding"] for known in told if known["round"] == 0]
    assert kinds[:3] == ["compared", "promised", "finalist"]
    assert told[0]["nrmse"] == pytest.approx(found.to_dict()["steps"][0]["nrmse_test"])
    assert len(told[1]["candidates"]) == 5
    added = [known for known in told if known["finding"] == "added"]
    assert added[0]["effect"] == found.to_dict()["steps"][1]["added"]["effect"]

    def stop(_: object) -> None:
        raise ValueError("enough")

    with pytest.raises(ValueError, match="enough"):
        ls.diagnose(MODEL, LOG, early=stop)


def test_other_threads_run_meanwhile() -> None:
    ticks, done = [], threading.Event()

    def tick() -> None:
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.002)

    thread = threading.Thread(target=tick)
    thread.start()
    ls.improve(MODEL, LOG)
    done.set()
    thread.join()
    assert len(ticks) > 10


@pytest.mark.skipif(sys.platform == "win32", reason="there are no signals")
def test_ctrl_c_ends_work_at_once(tmp_path: Path) -> None:
    frame = ls.Log.read(LOG).to_dict()
    period = frame["time_s"][1]
    long = {name: np.tile(values, 40) for name, values in frame.items()}
    long["time_s"] = np.arange(len(long["time_s"])) * period
    ls.Log.from_frame(long).save(tmp_path / "long.csv")
    program = (
        "import loopsight, sys, time\n"
        f"s = loopsight.Session({str(MODEL)!r}, {str(tmp_path / 'long.csv')!r})\n"
        "print('begun', flush=True)\n"
        "try:\n    s.improve()\n    print('finished')\n"
        "except KeyboardInterrupt:\n    print('interrupted', time.monotonic())\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None and child.stdout.readline() == "begun\n"
    time.sleep(1.0)
    pressed = time.monotonic()
    child.send_signal(signal.SIGINT)
    said = child.stdout.read().split()
    assert child.wait() == 0 and said[0] == "interrupted", said
    # A quarter of a second is promised; a busy machine gets more.
    assert float(said[1]) - pressed < 3.0


def command() -> Path | None:
    """The command of the same build."""
    import os

    built = os.environ.get("LOOPSIGHT")
    return Path(built) if built else None


@pytest.mark.skipif(command() is None, reason="LOOPSIGHT does not name the command")
@pytest.mark.parametrize("question", ["compare", "fit", "diagnose", "improve"])
@pytest.mark.parametrize("series", [False, True])
def test_the_answer_is_that_of_the_command_byte_for_byte(question: str, series: bool) -> None:
    asked = [str(command()), question, str(MODEL), str(LOG), "--json", *(["--series"] if series else [])]
    told = subprocess.run(asked, capture_output=True, text=True, check=False)
    answer = getattr(ls, question)(str(MODEL), str(LOG), series=series)
    assert answer.to_json() + "\n" == told.stdout
    assert json.loads(told.stdout) == answer.to_dict()
