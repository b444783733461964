"""Atomic writing of files: a file appears completely or not at all. Reading of regular files only:
a pipe or a device at an input path could block for ever or have no end."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import stat
import time
import unicodedata
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

MIN_AGE = 60.0  # seconds, of an unfinished file that counts as abandoned: each takes less to write


@contextlib.contextmanager
def atomic_path(path: Path, ending: str = ".part") -> Iterator[Path]:
    """A temporary path in the same folder to write to; it is renamed to ``path`` where the block
    succeeds.

    ending: of the temporary name, for writers that choose the format by it (".part.exr"). The name
    cannot be predicted: a symbolic link at a predictable name would be written through. Where the
    block raises, ``path`` is unchanged and the unfinished file is removed. Raises OSError.
    """
    partial = path.with_name(f"{path.name}.{secrets.token_hex(8)}{ending}")
    try:
        yield partial
        os.replace(partial, path)
    except BaseException:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)
        raise


def write_text_atomic(path: Path, text: str) -> None:
    """Write a text as UTF-8, atomically. Raises OSError."""
    with atomic_path(path) as partial:
        partial.write_text(text, "utf-8")


def remove_unfinished(folder: Path, pattern: str) -> None:
    """Remove the unfinished files that killed processes have left. pattern: of the names of the
    finished ones."""
    for path in folder.glob(f"{pattern}.*.part"):
        with contextlib.suppress(OSError):
            if time.time() - os.lstat(path).st_mtime > MIN_AGE:
                path.unlink()


def as_file_name(name: str) -> str:
    """A name so that two that are equal may be one file: some file systems ignore upper and lower
    case, and the two ways to write an accented letter in Unicode."""
    return unicodedata.normalize("NFC", name).casefold()


def regular_size(path: Path) -> int:
    """Size of a regular file in bytes. Raises OSError, also for a pipe, a device or a folder."""
    found = os.stat(path)
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(errno.EISDIR, "a folder; expected a file", str(path))
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "a pipe or device; expected a regular file", str(path))
    return found.st_size


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file to read its bytes. Raises OSError as ``regular_size``."""
    regular_size(path)
    return path.open("rb")


def read_regular(path: Path, max_bytes: int) -> bytes:
    """The bytes of a regular file, at most ``max_bytes`` of them. Raises OSError as
    ``regular_size``."""
    with open_regular(path) as file:
        return file.read(max_bytes)
