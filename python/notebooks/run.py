#!/usr/bin/env python3
"""Executes the notebooks of this folder and compares what they say with what is committed.

    python run.py [--write] [NAME …]

Every cell runs, in a fresh kernel for each notebook, and none may fail or warn. The texts must be those that are
committed: word for word, with numbers that agree to 3 %. Pictures must be where there were pictures. What a cell with
the tag `varies` says is not compared: times, and what hangs on how other packages round.

    --write    commits what the notebooks say now, without times and places of this machine
    NAME       only these, by the beginning of their names

A notebook whose metadata say `"needs": "LOOPSIGHT_DATA"` reads data that are not part of the project. Without that
variable it is not run, and this says so. It is committed without outputs.

It needs what `.ci/notebooks.txt` lists, and loopsight.
"""

from __future__ import annotations

import argparse
import base64
import io
import os
import re
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import nbformat
from jupyter_client import AsyncKernelManager
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from PIL import Image

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parents[1]
#: How far a number may move between two machines, as a share of it.
TOLERANCE = 0.03
NUMBER = re.compile(r"[-−+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
#: Parts of the metadata that do not tell of the machine.
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}


def said(output: Any) -> str:
    """An output as text; of a picture only that it is one."""
    if output.output_type == "stream":
        return str(output.text)
    data = output.get("data", {})
    if any(kind.startswith("image/") for kind in data):
        return "<a picture>\n"
    return str(data.get("text/plain", "")) + "\n"


def texts(cell: Any) -> str:
    """All that a cell says."""
    return "".join(said(output) for output in cell.outputs)


def differs(committed: str, now: str) -> bool:
    """Whether two texts differ in more than the last digits of their numbers."""
    # How wide a column is hangs on its digits.
    words = [re.sub(r"\s+", " ", NUMBER.sub("0", text)).strip() for text in (committed, now)]
    if words[0] != words[1]:
        return True
    pairs = zip(NUMBER.findall(committed), NUMBER.findall(now), strict=True)
    for one, other in pairs:
        a, b = (float(text.replace("−", "-")) for text in (one, other))
        # One in the last digit is rounding.
        last = 10.0 ** -len(one.partition("e")[0].partition(".")[2])
        if abs(a - b) > max(TOLERANCE * abs(a), 1.01 * last):
            return True
    return False


def private(text: str) -> str | None:
    """A place of this machine that a text names."""
    return next((place for place in (str(ROOT), str(Path.home()) + "/", "/tmp/") if place in text), None)


def execute(notebook: Any, name: str) -> list[str]:
    """Runs a notebook in place. What went wrong."""
    with tempfile.TemporaryDirectory() as sockets:
        # Over sockets of the file system: over TCP the kernel warns.
        manager = AsyncKernelManager(kernel_name="python3", transport="ipc", ip=f"{sockets}/kernel")
        client = NotebookClient(notebook, km=manager, timeout=300, resources={"metadata": {"path": str(FOLDER)}})
        client.owns_km = True  # it ends the kernel, too
        try:
            client.execute()
        except CellExecutionError as failed:
            return [f"{name}: a cell failed\n{failed}"]
    wrong = []
    for cell in notebook.cells:
        if cell.cell_type != "code":
            continue
        for output in cell.outputs:
            if output.output_type == "stream" and output.name == "stderr":
                wrong.append(f"{name}: a cell warns: {output.text.strip()}\n{cell.source}")
        if place := private(texts(cell)):
            wrong.append(f"{name}: a cell names {place}, which is not there on other machines\n{cell.source}")
    return wrong


def rotten(committed: Any, now: Any, name: str) -> list[str]:
    """The cells that no longer say what is committed."""
    wrong = []
    for before, after in zip(committed.cells, now.cells, strict=True):
        if after.cell_type != "code" or "varies" in after.metadata.get("tags", []):
            continue
        if differs(texts(before), texts(after)):
            wrong.append(
                f"{name}: a cell says something else than what is committed\n{after.source}\n"
                f"--- committed\n{texts(before)}--- now\n{texts(after)}"
            )
    return wrong


def small(picture: str) -> str:
    """The same picture with a palette: a third of the bytes, and nothing that an eye would miss."""
    packed = io.BytesIO()
    image = Image.open(io.BytesIO(base64.b64decode(picture))).convert("RGB")
    image.quantize(128).save(packed, "PNG", optimize=True)
    return base64.b64encode(packed.getvalue()).decode("ascii")


def plain(notebook: Any, outputs: bool) -> Any:
    """A notebook without what tells of the machine, and without outputs if so asked."""
    kept = {key: notebook.metadata[key] for key in ("loopsight",) if key in notebook.metadata}
    notebook.metadata = nbformat.from_dict({**METADATA, **kept})
    for cell in notebook.cells:
        tags = cell.metadata.get("tags")
        cell.metadata = nbformat.from_dict({"tags": tags} if tags else {})
        if cell.cell_type == "code":
            cell.outputs = [one for one in cell.outputs if outputs]
            for output in cell.outputs:
                if "metadata" in output:
                    output.metadata = nbformat.from_dict({})
                if "image/png" in output.get("data", {}):
                    output.data["image/png"] = small(output.data["image/png"])
            if not outputs:
                cell.execution_count = None
    return notebook


def check(path: Path, write: bool) -> list[str]:
    """Runs one notebook. What is wrong with it."""
    name = path.stem
    committed = nbformat.read(path, as_version=4)
    needs = committed.metadata.get("loopsight", {}).get("needs")
    empty = not any(cell.get("outputs") for cell in committed.cells)
    if needs and not empty:
        return [f"{name}: it has outputs, and what it reads is not ours to publish"]
    if needs and not os.environ.get(needs):
        print(f"{name}: not run, {needs} does not name a folder", flush=True)
        return []
    begun = time.monotonic()
    now = nbformat.read(path, as_version=4)
    wrong = execute(now, name)
    if not wrong and not needs and not write:
        wrong = rotten(committed, now, name)
    if write and not wrong:
        nbformat.write(plain(now, outputs=not needs), path)
    print(f"{name}: {'FAILED' if wrong else 'holds'}, {time.monotonic() - begun:.0f} s", flush=True)
    return wrong


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--write", action="store_true", help="commit what the notebooks say now")
    options.add_argument("names", nargs="*", metavar="NAME", help="only these, by the beginning of their names")
    asked = options.parse_args()
    paths = sorted(FOLDER.glob("*.ipynb"))
    for name in asked.names:
        if not any(path.stem.startswith(name) for path in paths):
            options.error(f"no notebook begins with `{name}`, there are {', '.join(p.stem for p in paths)}")
    chosen = [path for path in paths if not asked.names or path.stem.startswith(tuple(asked.names))]
    wrong = [mistake for path in chosen for mistake in check(path, asked.write)]
    print("\n\n".join(wrong), file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
