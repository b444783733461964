"""Results on disk, one JSON file an experiment: documents are written without computing again."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from ..common import cache_dir


def path(name: str, quick: bool) -> Path:
    """Where an experiment's results lie, in the user's cache."""
    return cache_dir() / "experiments" / f"{name}{'.quick' if quick else ''}.json"


def save(name: str, results: Any, quick: bool) -> None:
    """Write results; the file appears whole or not at all."""
    file = path(name, quick)
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_name(file.name + ".part")
    partial.write_text(json.dumps(results, indent=0) + "\n", "utf-8")
    os.replace(partial, file)


def load(name: str, quick: bool = False) -> Any | None:
    """What was saved, or None."""
    file = path(name, quick)
    return json.loads(file.read_text("utf-8")) if file.is_file() else None
