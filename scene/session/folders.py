"""Where files that belong to a .blend lie: beside it, or with the user while it is unsaved."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import bpy

from ...core.basis.merl_folder import user_cache
from .preferences import PACKAGE, preferences


def blend_folder() -> Path:
    """Beside the .blend where that can be written, else the extension's own folder."""
    if bpy.data.filepath:
        beside = Path(bpy.data.filepath).parent
        if os.access(beside, os.W_OK):
            return beside
    return own_folder()


def own_folder() -> Path:
    """The preferred one, else the extension's folder of the user's, which survives updates of the
    extension."""
    preferred = preferences().cache_folder
    if preferred:
        folder = cache_folder() / "files"
        folder.mkdir(parents=True, exist_ok=True)
        return folder
    try:
        return Path(bpy.utils.extension_path_user(PACKAGE, path="files", create=True))
    except ValueError:  # run from a checkout: not an extension
        folder = Path(bpy.app.tempdir) / "patina_files"
        folder.mkdir(parents=True, exist_ok=True)
        return folder


def cache_folder() -> Path:
    """For what takes long to compute and belongs to no .blend: bases of the artist's own files."""
    preferred = preferences().cache_folder
    return Path(bpy.path.abspath(preferred)) if preferred else user_cache()


def rectified_folder(capture: Path) -> Path:
    """For the resampled photos of one capture: photos of two captures may have the same names."""
    digest = hashlib.sha256(str(capture.resolve()).encode()).hexdigest()[:8]
    return blend_folder() / "rectified" / f"{capture.name.split('.')[0]}-{digest}"
