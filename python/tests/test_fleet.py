"""A fleet of logs, broken ones among them, on every engine."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import loopsight as ls
import pandas
import pytest

ROOT = Path(__file__).resolve().parents[2]
HIDDEN = ROOT / "examples/hidden-effect/oscillator_coulomb_friction"
MODEL = HIDDEN / "model.toml"


def fleet(folder: Path, good: int) -> Path:
    """A table of logs: `good` ones, and three that are broken."""
    frame = ls.Log.read(HIDDEN / "mixed.csv")
    rows = []
    for at in range(good):
        path = f"good{at}.csv"
        frame.part(10 * at, 2200).save(folder / path)
        rows.append({"robot": f"robot{at % 2}", "time": f"2026-11-{at + 1:02}", "path": path})
    (folder / "text.csv").write_text("time_s,force_N,position_m\n0.0,x,1\n")
    (folder / "short.csv").write_text("time_s,force_N,position_m\n0.0,0,0\n0.01,0,0\n")
    for broken in ("text.csv", "short.csv", "missing.csv"):
        rows.append({"robot": "robot0", "time": "2026-11-30", "path": broken})
    table = folder / "logs.parquet"
    pandas.DataFrame(rows).to_parquet(table)
    return table


@pytest.mark.parametrize("engine", ["processes", "ray", "dask"])
def test_each_log_is_a_row_and_a_broken_one_has_its_fault(engine: str, tmp_path: Path) -> None:
    table = fleet(tmp_path, 3)
    out = tmp_path / "found.parquet"
    found = ls.fleet.improve(table, MODEL, out=out, engine=engine, workers=2)
    assert found.equals(pandas.read_parquet(out)) and len(found) == 6
    assert not out.with_name(out.name + ".journal").exists()
    by_path = {Path(row["path"]).name: row for row in found.to_dict("records")}
    assert len(by_path) == 6
    for at in range(3):
        row = by_path[f"good{at}.csv"]
        assert (row["status"], row["effects"]) == ("done", "coulomb_friction@mass")
        assert row["nrmse_after"] < 0.2 * row["nrmse_before"]
        assert json.loads(row["parameters"])["mass"]["verdict"] == "good"
    assert "line 2" in by_path["text.csv"]["fault"] or "`x`" in by_path["text.csv"]["fault"]
    assert "missing.csv" in by_path["missing.csv"]["fault"]
    assert by_path["short.csv"]["status"] == "fault" and by_path["short.csv"]["fault"]
    shares = ls.fleet.effects(out)
    assert shares.loc["robot0", "faults"] == 3 and shares.loc["robot1", "coulomb_friction@mass"] == 1.0


@pytest.mark.skipif(sys.platform != "linux", reason="it looks at processes as Linux shows them")
def test_a_killed_job_goes_on_where_it_was(tmp_path: Path) -> None:
    table, out = fleet(tmp_path, 6), tmp_path / "found.parquet"
    program = (
        "import loopsight as ls\n"
        "if __name__ == '__main__':\n"
        f"    ls.fleet.improve({str(table)!r}, {str(MODEL)!r}, out={str(out)!r}, engine='processes', workers=1)\n"
    )
    script = tmp_path / "job.py"
    script.write_text(program)
    journal = out.with_name(out.name + ".journal")
    child = subprocess.Popen([sys.executable, str(script)])
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and (not journal.exists() or journal.read_text().count("\n") < 3):
        time.sleep(0.02)
    workers = subprocess.run(["pgrep", "-P", str(child.pid)], capture_output=True, text=True).stdout.split()
    assert workers
    child.send_signal(signal.SIGKILL)
    child.wait()
    while time.monotonic() < deadline and any(Path(f"/proc/{worker}").exists() for worker in workers):
        time.sleep(0.1)
    assert not any(Path(f"/proc/{worker}").exists() for worker in workers), "a worker was left behind"
    done = [json.loads(line) for line in journal.read_text().splitlines() if line.endswith("}")]
    assert 3 <= len(done) < 9, "it was killed in the middle"
    with journal.open("a") as half:
        half.write('{"robot": "rob')  # what a kill within a line leaves
    found = ls.fleet.improve(table, MODEL, out=out, engine="processes", workers=1)
    assert len(found) == 9
    seconds = {row["path"]: row["seconds"] for row in found.to_dict("records")}
    assert all(seconds[row["path"]] == row["seconds"] for row in done), "nothing was done twice"


def kill(task: int) -> dict[str, int]:
    """Work that a task of 3 does not survive."""
    if task == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.05)
    return {"task": task}


@pytest.mark.skipif(sys.platform == "win32", reason="there are no signals")
def test_only_the_task_that_kills_its_worker_is_blamed() -> None:
    answers = dict(ls.fleet.engine_named("processes")(kill, list(range(8)), 2, 1))
    assert sorted(answers) == list(range(8))
    assert answers.pop(3) == "its worker died 2 times"
    assert all(row == {"task": task} for task, row in answers.items())


def test_mistakes_are_named(tmp_path: Path) -> None:
    out = tmp_path / "found.parquet"
    for wrong, part in [
        (lambda: ls.fleet.improve(tmp_path / "no.parquet", MODEL, out=out), "no table of logs"),
        (lambda: ls.fleet.improve(pandas.DataFrame({"log": []}), MODEL, out=out), "no column `path`"),
        (
            lambda: ls.fleet.improve(pandas.DataFrame({"path": ["a", "a"]}), MODEL, out=out),
            "is there twice",
        ),
        (
            lambda: ls.fleet.improve(pandas.DataFrame({"path": []}), MODEL, out=out, engine="spark"),
            "expected one of ray, dask, processes",
        ),
    ]:
        with pytest.raises(ls.Error) as caught:
            wrong()
        assert part in str(caught.value)
