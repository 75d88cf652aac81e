"""Compares what was found in a fleet with what was hidden in it: right, missed, false alarms."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import loopsight as ls
import pandas as pd

HERE = Path(__file__).resolve().parent


def line(what: str, hidden: set[Any], marked: set[Any]) -> list[Any]:
    return [what, len(hidden), len(hidden & marked), len(hidden - marked), len(marked - hidden)]


def kinds(what: str, hidden: set[Any], marked: set[Any]) -> list[list[Any]]:
    """A line for each kind of secret: the second of each pair."""
    return [
        line(f"{what} {kind}", *({pair for pair in both if pair[1] == kind} for both in (hidden, marked)))
        for kind in sorted({kind for _, kind in hidden})
    ]


def pairs(table: pd.DataFrame) -> set[Any]:
    return set(table[["robot", "parameter"]].itertuples(index=False, name=None))


def judged(truth: pd.DataFrame, found: pd.DataFrame) -> tuple[pd.DataFrame, dict[str, set[Any]]]:
    """A row for each kind of secret, and the false alarms of each question."""
    names = found["path"].map(lambda path: Path(path).name)
    broken = set(names[found["status"] != "done"])
    rows, false = [], {}
    truth = truth.assign(name=truth["path"].map(lambda path: Path(path).name))
    wrong = truth[truth["broken"] != ""]
    for kind, files in wrong.groupby("broken"):
        hidden = set(files["name"])
        rows.append([f"file: {kind}", len(hidden), len(hidden & broken), len(hidden - broken), ""])
    rows.append(line("files, all kinds", set(wrong["name"]), broken))

    table = ls.fleet.missing(found)
    marked = {(row["robot"], row["effect"].partition("@")[0]) for row in table[table["lacks"]].to_dict("records")}
    faulty = truth[(truth["fault"] != "") & (truth["broken"] == "")]
    lacking = set(zip(faulty["robot"], faulty["fault"], strict=True))
    rows += kinds("lacks", lacking, marked)
    false["missing"] = marked - lacking
    rows.append(line("missing effects, all", lacking, marked))

    table = ls.fleet.trends(found)
    marked = pairs(table[table["moves"]])
    ageing, odd = (pairs(truth[truth["role"] == role]) for role in ("ageing", "odd"))
    rows += kinds("moves", ageing, marked)
    false["trends"] = marked - ageing
    rows.append(line("trends, all", ageing, marked))

    table = ls.fleet.siblings(found)
    marked = pairs(table[table["apart"]])
    rows.append(line("apart from the first day", odd, marked & odd))
    rows.append(line("apart by ageing", ageing, marked & ageing))
    false["siblings"] = marked - ageing - odd
    rows.append(line("siblings, all", ageing | odd, marked))
    return pd.DataFrame(rows, columns=["what", "hidden", "right", "missed", "false alarms"]), false


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=HERE / "made", help="what make.py and find.py wrote")
    parser.add_argument("--least", type=float, help="fail when a smaller share of what was hidden is found")
    given = parser.parse_args()
    truth = pd.read_parquet(given.folder / "truth" / "truth.parquet")
    found = pd.read_parquet(given.folder / "found.parquet")
    table, false = judged(truth, found)
    print(table.to_string(index=False))
    for question, alarms in false.items():
        for robot, what in sorted(alarms):
            print(f"false alarm of {question}: {robot} {what}")
    if given.least is not None:
        for what in ("files, all kinds", "missing effects, all"):
            row = table[table["what"] == what].iloc[0]
            if row["right"] < given.least * row["hidden"] or row["false alarms"] > 0.1 * row["hidden"] + 1:
                raise SystemExit(f"{what}: {row['right']} of {row['hidden']}, {row['false alarms']} false alarms")


if __name__ == "__main__":
    main()
