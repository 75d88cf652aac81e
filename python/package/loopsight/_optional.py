"""Packages that only some of this one needs."""

from __future__ import annotations

import importlib
from typing import Any


def needed(who: str, *modules: str) -> Any:
    """The first of some modules. Where a package is missing it says `who` needs them, and how they are installed."""
    try:
        return [importlib.import_module(module) for module in modules][0]
    except ImportError as missing:
        names = [module.partition(".")[0] for module in modules]
        noun = "package" if len(names) == 1 else "packages"
        raise ImportError(f"{who} the {noun} {' and '.join(names)}: pip install {' '.join(names)}") from missing
