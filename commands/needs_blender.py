"""Test whether Blender is available; error for commands that cannot run without it."""

from __future__ import annotations

import importlib.util

from ..core.errors import PatinaError

HOW = "run it in Blender: blender -b --python-exit-code 1 -P headless.py --"


def has_blender() -> bool:
    """Return whether bpy can be imported and Patina's Blender code (``scene``) is installed.

    The extension contains ``scene``; the Python package does not.
    """
    package = (__package__ or "").rpartition(".")[0]
    return all(importlib.util.find_spec(name) is not None for name in ("bpy", f"{package}.scene"))


def check_blender(what: str, command: str) -> None:
    """Raise PatinaError if Blender is not available; its message says how to run ``command`` there.

    what: the subject of the sentence, such as "`render`" or "the format usd".
    """
    if not has_blender():
        raise PatinaError(f"{what} needs Blender; {HOW} {command} …")
