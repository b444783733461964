"""The cache on disk: files that Patina can create again.

It holds bases of the user's own MERL files, and the shader EXRs and undistorted photos of unsaved
.blend files. Painted masks are not part of it.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from functools import partial
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
_own: tuple[tuple[Path, Path], Basis] | None = None
"""The source of the basis that was computed last, and the basis."""


def cached_files() -> dict[Path, int]:
    """Every cached file → its size in bytes."""
    own = own_folder()
    found = [p for p in own.glob("*.exr") if osl_atlas.is_own_name(p.name)]
    if not (own / "rectified").is_symlink():  # a link may point to other files
        found += (own / "rectified").rglob("*")
    found += cache_folder().glob("merl_basis_*.npz")
    return {path: path.stat().st_size for path in found if path.is_file()}


def empty_cache() -> tuple[int, int]:
    """Remove all files that the open .blend does not use; returns (files, bytes) removed."""
    return _drop(0)


def trim_cache() -> tuple[int, int]:
    """Remove the oldest files until the cache has the size set in the preferences. Files that the
    open .blend uses stay. Returns (files, bytes) removed."""
    return _drop(preferences().cache_size * MB)


def own_basis() -> Basis | Callable[[], Basis] | None:
    """The basis of the user's own MERL files, or a function that computes it; None without such
    files.

    The function is slow and does not use Blender. It raises InputError if the files are not the
    MERL database.
    """
    source = basis_source()
    if source is None:
        return None
    if _own is not None and _own[0] == source:
        return _own[1]
    return partial(cached_basis, source[0], cache=source[1])


def keep_basis(source: tuple[Path, Path] | None, basis: Basis) -> None:
    """Keep the basis that was computed from a source, because the checksums of the files take
    seconds."""
    global _own
    _own = None if source is None else (source, basis)


def basis_source() -> tuple[Path, Path] | None:
    """(folder of the user's own MERL files, folder of computed bases); None without such files."""
    folder = preferences().merl_folder
    return (Path(bpy.path.abspath(folder)), cache_folder()) if folder else None


def _drop(limit: int) -> tuple[int, int]:
    files = cached_files()
    size, used = sum(files.values()), _in_use()
    count = removed = 0
    for path in sorted(files, key=_age):
        if size - removed <= limit:
            break
        if used & {os.path.abspath(path), str(path.resolve())}:
            continue
        try:
            path.unlink()
        except OSError as error:
            log.warning("%s: cannot be removed (%s)", path, error.strerror)
            continue
        count, removed = count + 1, removed + files[path]
    return count, removed


def _age(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _in_use() -> set[str]:
    """Absolute paths of the files that the open .blend reads: images and shader files.

    The paths are not looked up on disk, because they may point to a foreign server.
    """
    paths = [bpy.path.abspath(i.filepath) for i in bpy.data.images if i.filepath]
    for node in osl_files.own_shaders():
        paths += [socket.default_value for socket in osl_files.file_sockets(node)]
    return {os.path.abspath(path) for path in paths if path}


@bpy.app.handlers.persistent
def _after_load(*_: object) -> None:
    trim_cache()


def _forget() -> None:
    global _own
    _own = None


HANDLERS = (("load_post", _after_load),)


def register() -> None:
    """Trim the cache whenever a file is opened."""
    attach(HANDLERS)


def unregister() -> None:
    """Remove the handler and forget the basis."""
    detach(HANDLERS)
    _forget()
