"""Folders of files that belong to a .blend: next to it, or in a user folder while it is unsaved."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import bpy

from ...core.basis.merl_folder import user_cache
from .preferences import PACKAGE, preferences

EXTENSION = Path(__file__).resolve().parents[2]


def blend_folder() -> Path:
    """The folder of the .blend if it can be written to, else the extension's own folder."""
    if bpy.data.filepath:
        folder = Path(bpy.data.filepath).parent
        if os.access(folder, os.W_OK):
            return folder
    return own_folder()


def export_folder(capture: str) -> Path:
    """Where exports are written by default: next to the .blend, else next to the capture, else in
    the user's home. Never in the extension's own folder, which an update deletes.

    capture: path of the capture file, "" if there is none.
    """
    for file in (bpy.data.filepath, capture):
        folder = Path(file).parent
        if file and not within_extension(folder) and os.access(folder, os.W_OK):
            return folder
    home = Path.home()
    documents = home / "Documents"
    return documents if documents.is_dir() else home


def within_extension(folder: Path) -> bool:
    """Whether a folder is that of the extension, or lies in it."""
    return folder.resolve().is_relative_to(EXTENSION)


def own_folder() -> Path:
    """The folder set in the preferences, else the extension's user folder, which survives updates
    of the extension. It is created if necessary."""
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
    """Folder for bases of the user's own MERL files, which take long to compute and belong to no
    .blend."""
    preferred = preferences().cache_folder
    return Path(bpy.path.abspath(preferred)) if preferred else user_cache()


def rectified_folder(capture: Path) -> Path:
    """Folder for the resampled photos of one capture; the path has a hash because names may be
    equal."""
    digest = hashlib.sha256(str(capture.resolve()).encode()).hexdigest()[:8]
    return blend_folder() / "rectified" / f"{capture.name.split('.')[0]}-{digest}"
