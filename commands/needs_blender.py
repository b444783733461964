"""Whether Blender is available, and the error for commands that cannot run without it."""

from __future__ import annotations

import importlib.util

from ..core.errors import PatinaError

HOW = "run it in Blender: blender -b --python-exit-code 1 -P headless.py --"


def has_blender() -> bool:
    """Whether this Python runs in Blender or has bpy, and Patina's Blender code is installed.

    The Python package, unlike the extension, leaves that code (``scene``) out.
    """
    package = (__package__ or "").rpartition(".")[0]
    return all(importlib.util.find_spec(name) is not None for name in ("bpy", f"{package}.scene"))


def check_blender(what: str, command: str) -> None:
    """Raise PatinaError, which says how to run ``command`` in Blender, where there is none.

    what: the subject of the sentence, such as "`render`" or "the format usd".
    """
    if not has_blender():
        raise PatinaError(f"{what} needs Blender; {HOW} {command} …")
