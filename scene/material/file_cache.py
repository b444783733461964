"""What Patina keeps on disk to be quick, or to show .blend files that have no folder yet.

Bases of the artist's own MERL files, the shaders' EXRs and the straightened photos of unsaved
.blend files: all of it can be made again. Masks that were painted are no cache.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import bpy

from ...core.appearance import osl_atlas
from ...core.basis import Basis
from ...core.basis.merl_folder import cached_basis
from ..session.folders import cache_folder, own_folder
from ..session.handlers import attach, detach
from ..session.preferences import preferences
from . import osl_files

log = logging.getLogger(__name__)

MB = 1_000_000  # bytes


def cached_files() -> dict[Path, int]:
    """Every file that can be made again → its bytes."""
    own = own_folder()
    found = [p for p in own.glob("*.exr") if osl_atlas.is_own_name(p.name)]
    if not (own / "rectified").is_symlink():  # a link may lead to files that are not Patina's
        found += (own / "rectified").rglob("*")
    found += cache_folder().glob("merl_basis_*.npz")
    return {path: path.stat().st_size for path in found if path.is_file()}


def empty_cache() -> tuple[int, int]:
    """Remove all but what the open .blend shows; returns (files, bytes) that are gone."""
    return _drop(0)


def trim_cache() -> tuple[int, int]:
    """Remove the oldest until it is no larger than the preferences say; likewise."""
    return _drop(preferences().cache_size * MB)


def own_basis() -> Callable[[], Basis] | None:
    """How to come by the basis of the artist's own MERL files, where there are any; it takes a
    while and knows no Blender. Raises InputError where the files are not the database."""
    folder = preferences().merl_folder
    if not folder:
        return None
    source, cache = Path(bpy.path.abspath(folder)), cache_folder()
    return lambda: _basis(source, cache)


@lru_cache(maxsize=1)  # the files' sums take seconds
def _basis(folder: Path, cache: Path) -> Basis:
    return cached_basis(folder, cache=cache)


def _drop(most: int) -> tuple[int, int]:
    files = cached_files()
    size, kept = sum(files.values()), _in_use()
    count = gone = 0
    for path in sorted(files, key=_age):
        if size - gone <= most:
            break
        if kept & {os.path.abspath(path), str(path.resolve())}:
            continue
        try:
            path.unlink()
        except OSError as error:
            log.warning("%s: cannot be removed (%s)", path, error.strerror)
            continue
        count, gone = count + 1, gone + files[path]
    return count, gone


def _age(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _in_use() -> set[str]:
    """What the open .blend reads: pictures, and the files of its shaders. The paths are not looked
    up on disk: they may name somebody's server."""
    told = [bpy.path.abspath(i.filepath) for i in bpy.data.images if i.filepath]
    for node in osl_files.own_shaders():
        told += [socket.default_value for socket in osl_files.file_sockets(node)]
    return {os.path.abspath(one) for one in told if one}


@bpy.app.handlers.persistent
def _after_load(*_: object) -> None:
    trim_cache()


HANDLERS = (("load_post", _after_load),)


def register() -> None:
    """Keep to the largest size from now on."""
    attach(HANDLERS)


def unregister() -> None:
    """No more."""
    detach(HANDLERS)
    _basis.cache_clear()
