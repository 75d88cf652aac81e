"""`docs/python.md`, taken at its word: every block of Python runs as it stands there, in order."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import loopsight as ls
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

ROOT = Path(__file__).resolve().parents[2]
HIDDEN = ROOT / "examples/hidden-effect"
#: A heading, or a block of Python.
PART = re.compile(r"^## ([^\n]+)$|^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks() -> list[tuple[str, str]]:
    """The blocks of Python of the page, each with the heading above it."""
    heading, found = "", []
    for part in PART.finditer((ROOT / "docs/python.md").read_text(encoding="utf-8")):
        if part[1] is not None:
            heading = part[1]
        else:
            found.append((heading, part[2]))
    return found


def bag(path: Path, log: ls.Log) -> None:
    """A ROS 2 bag as a robot with one motor writes it: its voltage, and the state of its joint."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    double, state, header, stamp = (
        store.types[kind]
        for kind in ("std_msgs/msg/Float64", "sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        voltage = writer.add_connection("/motor/voltage", double.__msgtype__, typestore=store)
        joint = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
        for t, u, w in zip(log["time_s"], log["voltage_V"], log["speed_rad_per_s"], strict=True):
            now = 1_763_700_000 * 10**9 + round(t * 1e9)
            writer.write(voltage, now, store.serialize_cdr(double(float(u)), double.__msgtype__))
            at = header(stamp(now // 10**9, now % 10**9), "base")
            sent = state(at, ["shaft"], np.zeros(0), np.array([w]), np.zeros(0))
            writer.write(joint, now, store.serialize_cdr(sent, state.__msgtype__))


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that the page names."""
    folder = tmp_path_factory.mktemp("desk")
    (folder / "examples").symlink_to(ROOT / "examples")
    shutil.copy(HIDDEN / "oscillator_coulomb_friction/model.toml", folder / "model.toml")
    shutil.copy(HIDDEN / "oscillator_coulomb_friction/mixed.csv", folder / "log.csv")
    bag(folder / "rosbag2_2026_11_21", ls.Log.read(HIDDEN / "constant_force/prbs.csv"))
    return folder


def test_every_block_of_the_page_runs_as_it_stands(
    desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(desk)
    two = np.repeat(["first", "second"], 3)
    frame = {"t": np.tile([0.0, 0.01, 0.02], 2), "u": np.ones(6), "w": np.arange(6.0), "run": two}
    names: dict[str, Any] = {"frame": frame}
    said: dict[str, list[str]] = {}
    for heading, block in blocks():
        if heading == "A fleet":
            continue  # it begins processes: test_fleet.py
        # A traced function is read from nowhere, so its text need not be a file.
        exec(compile(block, f"docs/python.md, {heading}", "exec"), names)
        said.setdefault(heading, []).append(capsys.readouterr().out)
        if heading == "From a log to a better model":
            assert "error 19.17 %" in said[heading][-1] and "effect_missing coulomb_friction" in said[heading][-1]
            assert ls.compare("better.toml", "log.csv").nrmse < 0.01
        if heading == "Logs" and len(said[heading]) == 1:
            assert (names["log"].columns, names["log"].runs) == (["time_s", "voltage_V", "speed_rpm"], 2)
    assert len(said["Logs"]) == 2 and "[log.measured.speed]" in said["Logs"][1]
    assert "'value': 0.2" in said["Effects and plants of one's own"][0], "0.25 N of friction are hidden in it"


def test_from_a_bag_to_a_diagnosis_in_five_lines(desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    five = next(block for _, block in blocks() if "rosbag2" in block)
    assert len([line for line in five.splitlines() if line.strip()]) == 5
    monkeypatch.chdir(desk)
    names: dict[str, Any] = {}
    exec(five.replace("print(ls.diagnose", "found = (ls.diagnose"), names)
    found = names["found"]
    # A weight on a rope. A motor's log alone cannot tell its pull from a constant voltage, and the answer says so.
    best = found.candidates[0]
    assert found.verdict == "effect_missing" and best.nrmse < 0.2 * found.nominal.nrmse
    assert "constant_force" in [best.effect, *(other.effect for other in best.indistinguishable_from)]
