"""Cache what was read from a file until the file changes."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache, wraps
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")

# FAT rounds modification times to 2 s: a later change of a younger file could go unnoticed
MIN_AGE_NS = 3_000_000_000
MAX_FILES = 4096  # cached results; more than a capture has photos


def once_per_file(read: Callable[[Path], T]) -> Callable[[Path], T]:
    """Call ``read(path)`` again only if the file's inode, size or modification time has changed.

    All callers share the result and must not modify it. A file that was changed less than
    MIN_AGE_NS ago is always read, and errors are never cached. Raises what ``read`` raises.
    """

    @lru_cache(MAX_FILES)
    def known(path: Path, device: int, inode: int, size: int, changed: int) -> T:
        return read(path)

    @wraps(read)
    def reader(path: Path) -> T:
        try:
            found = path.stat()
        except (OSError, ValueError):  # read raises the error for the user
            return read(path)
        if time.time_ns() - found.st_mtime_ns < MIN_AGE_NS:
            return read(path)
        return known(path, found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns)

    return reader
