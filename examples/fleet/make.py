"""Makes a fleet with secrets: logs of many robots over weeks, and apart from them what was hidden where."""

from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd

HERE = Path(__file__).resolve().parent
#: What is hidden in every twentieth robot, in this order; all others are healthy.
#: A fault is an effect that the model does not have.
FAULTS = ("dead_zone", "linear_stiffness", "torque_ripple", "input_saturation", "backlash")
#: A parameter of the model that moves over the weeks.
AGEING = ("friction", "delay", "gain")
#: A parameter that was different from the first day on.
ODD = ("friction", "bearing")
ROLES = [*(("fault", kind) for kind in FAULTS), *(("ageing", kind) for kind in AGEING), *(("odd", kind) for kind in ODD)]
#: The parameter of the model in which each shows.
PARAMETER = {"friction": "coulomb_friction.level", "delay": "input_delay.delay", "gain": "K_C", "bearing": "K_A"}
#: How a file can be broken.
BROKEN = ("cut", "empty", "text", "nan", "columns", "dead")
#: The share of files that are.
SHARE = 0.05
#: Samples of a log at 100 Hz: 5 s.
SAMPLES = 500


def quantities(role: tuple[str, str], along: float, own: dict[str, float]) -> dict[str, float]:
    """The sizes of what `loopsight-hidden` builds into a robot, `along` from 0 to 1 through the weeks."""
    sizes = {
        "coulomb_friction": 0.30 * own["friction"],
        "viscous_friction": 0.20 * own["bearing"],
        "input_delay": 0.40 * own["delay"],
        "sensor_scale": 1.0 + 12.5 * (own["gain"] - 1.0),
    }
    match role:
        case ("ageing", "friction"):
            sizes["coulomb_friction"] *= 1.0 + 0.4 * own["strength"] * along
        case ("ageing", "delay"):
            sizes["input_delay"] *= 1.0 + 0.4 * own["strength"] * along
        case ("ageing", "gain"):
            sizes["sensor_scale"] -= 0.6 * own["strength"] * along
        case ("odd", "friction"):
            sizes["coulomb_friction"] *= 1.0 + 0.4 * own["strength"]
        case ("odd", "bearing"):
            sizes["viscous_friction"] *= 1.0 + 0.7 * own["strength"]
    return sizes


def broken(kind: str, text: str, rng: np.random.Generator) -> str:
    """A log that went wrong on its way."""
    head, *rows = text.splitlines()
    match kind:
        case "cut":
            end = int(rng.uniform(0.3, 0.9) * len(text))
            # In the middle of a line: what a full disk leaves.
            return text[: text.rindex(",", 0, end)]
        case "empty":
            return ""
        case "text":
            return "<html><body>504 Gateway Time-out</body></html>\n"
        case "nan":
            return "\n".join([head, *(row.rpartition(",")[0] + ",nan" for row in rows)]) + "\n"
        case "columns":
            return "\n".join(["time_s,temperature_C,current_A", *rows]) + "\n"
        case _:
            return "\n".join([head, *(row.rpartition(",")[0] + ",0" for row in rows)]) + "\n"


def program(given: str | None) -> str:
    """The program that builds machines with secrets."""
    built = [HERE.parents[1] / "target" / profile / "loopsight-hidden" for profile in ("release", "debug")]
    for one in [given] if given else [*map(str, built), "loopsight-hidden"]:
        if shutil.which(one):
            return one
    raise SystemExit(f"there is no program {given or 'loopsight-hidden'}: cargo build --release -p loopsight-hidden")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=200)
    parser.add_argument("--logs", type=int, default=10, help="logs of each robot, one a week")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--hidden", help="the program loopsight-hidden; by default that of target/")
    parser.add_argument("-o", "--out", type=Path, default=HERE / "made", help="the folder to write")
    given = parser.parse_args()
    hidden, rng = program(given.hidden), np.random.default_rng(given.seed)
    logs, truth = given.out / "logs", given.out / "truth"
    for folder in (logs, truth):
        folder.mkdir(parents=True, exist_ok=True)

    table, secrets, jobs = [], [], []
    for robot in range(given.robots):
        name = f"axis-{robot:03}"
        role = ROLES[robot % 20] if robot % 20 < len(ROLES) else ("healthy", "")
        # Siblings are not twins, and a day is not like another.
        own = {what: 1.0 + rng.normal() * by for what, by in
               (("friction", 0.05), ("bearing", 0.05), ("delay", 0.03), ("gain", 0.004))}
        own["strength"] = rng.uniform(0.7, 1.3)
        own["fault"] = rng.uniform(0.2, 1.0)
        onset = 0 if robot // 20 % 2 == 0 else given.logs // 3
        for week in range(given.logs):
            time = datetime(2026, 6, 1, 8) + timedelta(weeks=week, hours=float(rng.uniform(0.0, 60.0)))
            along = week / max(given.logs - 1, 1)
            today = {what: value * (1.0 + 0.01 * rng.normal()) if what in ("friction", "bearing") else value
                     for what, value in own.items()}
            sizes = quantities(role, along, today)
            fault = role[1] if role[0] == "fault" and week >= onset else ""
            if fault:
                sizes[fault] = own["fault"]
            kind = str(rng.choice(BROKEN)) if rng.random() < SHARE else ""
            path = f"logs/{name}-{week:02}.csv"
            table.append({"robot": name, "time": time, "path": path})
            secrets.append({"robot": name, "time": time, "path": path, "role": role[0], "kind": role[1],
                            "parameter": PARAMETER.get(role[1], ""), "fault": fault, "broken": kind, **sizes})
            jobs.append((given.out / path, sizes, int(rng.integers(1, 2**31)), kind, int(rng.integers(2**31))))

    def make(job: tuple[Path, dict[str, float], int, str, int]) -> None:
        path, sizes, seed, kind, chance = job
        effects = "axis:" + "+".join(f"{effect}={size:.6f}" for effect, size in sizes.items())
        with tempfile.TemporaryDirectory() as desk:
            whole = Path(desk) / "log.csv"
            command = [hidden, "one", effects, "multi_level", str(seed), "-o", str(whole)]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            text = "\n".join(whole.read_text().splitlines()[: SAMPLES + 1]) + "\n"
        path.write_text(broken(kind, text, np.random.default_rng(chance)) if kind else text)

    with ThreadPoolExecutor() as pool:
        list(pool.map(make, jobs))
    pd.DataFrame(table).to_parquet(given.out / "logs.parquet", index=False)
    pd.DataFrame(secrets).to_parquet(truth / "truth.parquet", index=False)
    wrong = sum(1 for secret in secrets if secret["broken"])
    print(f"{len(table)} logs of {given.robots} robots in {given.out}, {wrong} of them broken")


if __name__ == "__main__":
    main()
