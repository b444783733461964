"""Keep what was read from a file for as long as the file stays the same."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache, wraps
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")

MIN_AGE_NS = 3_000_000_000  # FAT rounds times of change to 2 s: a younger file may change unseen
MAX_FILES = 4096  # whose results are kept: more photos than a capture has


def once_per_file(read: Callable[[Path], T]) -> Callable[[Path], T]:
    """Call ``read(path)`` again only where the file's inode, size or time of change is another.

    The result is shared by all callers: it must not be changed. A file that was changed a moment
    ago is always read, and an error is never kept. Raises what ``read`` raises.
    """

    @lru_cache(MAX_FILES)
    def known(path: Path, device: int, inode: int, size: int, changed: int) -> T:
        return read(path)

    @wraps(read)
    def reader(path: Path) -> T:
        try:
            found = path.stat()
        except (OSError, ValueError):  # read says what is wrong with it
            return read(path)
        if time.time_ns() - found.st_mtime_ns < MIN_AGE_NS:
            return read(path)
        return known(path, found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns)

    return reader
