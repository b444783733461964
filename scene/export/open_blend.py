"""Open the .blend of a result, which a stranger may have made: its scripts never run."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...core.errors import PatinaError


def open_blend(file: Path) -> None:
    """Open a .blend in place of the present one. Raises PatinaError if that is not possible."""
    try:
        bpy.ops.wm.open_mainfile(filepath=str(file), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        message = " ".join(str(error).split())
        raise PatinaError(f"{file}: cannot be opened as a .blend ({message})") from error
