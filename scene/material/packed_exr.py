"""Write an EXR that a .blend carries to disk, without trusting the .blend.

A .blend may come from anybody, and so may the folder that it lies in. Only files with Patina's own
names are written, only bytes that begin as an EXR does, only into a folder that exists, and never
through a symbolic link.
"""

from __future__ import annotations

import logging
import os
import stat
from pathlib import Path

import bpy

from ...core.appearance.osl_atlas import EXR_MAGIC, MAX_FILE_BYTES, is_own_name

log = logging.getLogger(__name__)

NEW_FILE = (
    os.O_WRONLY
    | os.O_CREAT
    | os.O_EXCL
    | getattr(os, "O_NOFOLLOW", 0)  # Windows has no such flag,
    | getattr(os, "O_BINARY", 0)  # and only Windows has this one
)


def write_packed(image: bpy.types.Image | None, path: Path) -> bool:
    """Write an image's packed bytes to a file, whole or not at all; False where it has none, or
    where the name, the bytes or what lies at the path is refused (the log says why)."""
    if image is None or image.packed_file is None:
        return False
    refusal = _refusal(image.packed_file, path)
    if refusal:
        log.warning("%.300r is not written: %s", str(path), refusal)
        return False
    partial = _partial(path)
    try:
        if is_regular_file(partial):  # left by an interrupted write
            partial.unlink()
        with os.fdopen(os.open(partial, NEW_FILE, 0o666), "wb") as file:
            file.write(image.packed_file.data)
        os.replace(partial, path)  # replaces a link that appeared meanwhile, never its target
    except OSError as error:
        log.warning("%s: cannot be written (%s)", path, error.strerror)
        return False
    return True


def is_regular_file(path: Path) -> bool:
    """Whether a regular file lies there itself, not a symbolic link to one."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except (OSError, ValueError):  # ValueError: a path with a null character
        return False


def _refusal(packed: bpy.types.PackedFile, path: Path) -> str:
    """Why these bytes are not written there; "" where they are."""
    if not is_own_name(path.name):
        return "Patina makes no file of this name; if you trust the .blend, fit the material again"
    for place in (path, _partial(path)):
        if os.path.lexists(place) and not is_regular_file(place):
            return f"{place.name} is a symbolic link or no regular file; remove it, then reopen"
    if packed.size > MAX_FILE_BYTES:
        return (
            f"the .blend packs {packed.size:,} bytes for it, expected at most {MAX_FILE_BYTES:,}; "
            "fit the material again"
        )
    if bytes(packed.data[: len(EXR_MAGIC)]) != EXR_MAGIC:
        return "what the .blend packs for it is not an EXR; fit the material again"
    return ""


def _partial(path: Path) -> Path:
    return path.with_name(path.name + ".part")
