"""The capture file of a scene, which may have been moved or deleted since the import."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...core.errors import InputError


def existing_capture(path: str) -> Path:
    """Absolute path of a capture file. Raises InputError if it does not exist."""
    file = Path(bpy.path.abspath(path))
    if not file.is_file():
        raise InputError(
            "the file does not exist; import the capture again from its current folder", file=file
        )
    return file
