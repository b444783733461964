"""Write an EXR that is packed in a .blend to disk, without trusting the .blend.

A .blend and its folder may come from an untrusted source. Only files with Patina's own names are
written, only bytes that begin like an EXR, only into an existing folder, and never through a
symbolic link.
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
    """Write an image's packed bytes to a file, completely or not at all.

    Returns False if the image has no packed bytes, or if the name, the bytes or the present file
    at the path is rejected (the reason is logged).
    """
    if image is None or image.packed_file is None:
        return False
    reason = _rejection(image.packed_file, path)
    if reason:
        log.warning("%.300r was not written: %s.", str(path), reason)
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
    """Whether the path is a regular file, not a symbolic link to one."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except (OSError, ValueError):  # ValueError: a path with a null character
        return False


def _rejection(packed: bpy.types.PackedFile, path: Path) -> str:
    """Why these bytes must not be written to the path; "" if they may."""
    if not is_own_name(path.name):
        return "it is not a file name of Patina; if you trust the .blend, fit the material again"
    for place in (path, _partial(path)):
        if os.path.lexists(place) and not is_regular_file(place):
            return f"{place.name} is a symbolic link or not a regular file; remove it, then reopen"
    if packed.size > MAX_FILE_BYTES:
        return (
            f"the packed file has {packed.size:,} bytes, expected at most {MAX_FILE_BYTES:,}; fit "
            "the material again"
        )
    if bytes(packed.data[: len(EXR_MAGIC)]) != EXR_MAGIC:
        return "the packed file is not an EXR; fit the material again"
    return ""


def _partial(path: Path) -> Path:
    return path.with_name(path.name + ".part")
