"""Results on disk, one JSON file per experiment, to write documents without running it again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from patina.core.files import write_text_atomic

from ..common import cache_dir


def path(name: str, quick: bool) -> Path:
    """Return the file of an experiment's results, in the user's cache."""
    return cache_dir() / "experiments" / f"{name}{'.quick' if quick else ''}.json"


def save(name: str, results: Any, quick: bool) -> None:
    """Write results; an interrupted call leaves no incomplete file."""
    file = path(name, quick)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_text_atomic(file, json.dumps(results, indent=0) + "\n")


def load(name: str, quick: bool = False) -> Any | None:
    """Return the stored results, or None."""
    file = path(name, quick)
    return json.loads(file.read_text("utf-8")) if file.is_file() else None
