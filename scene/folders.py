"""Where files that belong to a .blend lie: beside it, or with the user while it is unsaved."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import bpy


def blend_folder() -> Path:
    """Beside the .blend where that can be written, else the extension's own folder."""
    if bpy.data.filepath:
        beside = Path(bpy.data.filepath).parent
        if os.access(beside, os.W_OK):
            return beside
    return own_folder()


def own_folder() -> Path:
    """The extension's folder of the user's, which survives updates of the extension."""
    package = __package__.rpartition(".")[0]
    try:
        return Path(bpy.utils.extension_path_user(package, path="files", create=True))
    except ValueError:  # run from a checkout: not an extension
        folder = Path(bpy.app.tempdir) / "patina_files"
        folder.mkdir(parents=True, exist_ok=True)
        return folder


def rectified_folder(capture: Path) -> Path:
    """For the resampled photos of one capture: photos of two captures may have the same names."""
    digest = hashlib.sha256(str(capture.resolve()).encode()).hexdigest()[:8]
    return blend_folder() / "rectified" / f"{capture.name.split('.')[0]}-{digest}"
