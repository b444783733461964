"""Where files that belong to a .blend lie: beside it, or with the user while it is unsaved."""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy

PACKAGE = __package__.rpartition(".")[0]


def working_folder() -> Path:
    """A folder for resampled photos and component atlases of the open .blend."""
    if bpy.data.filepath:
        return Path(bpy.data.filepath).parent / "patina"
    if PACKAGE.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(PACKAGE, path="unsaved", create=True))
    return Path(tempfile.gettempdir()) / "patina-unsaved"
