"""Locks on folders. The system releases them when a process ends, however it ends."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO


class FolderLock:
    """A lock on a folder that this process holds."""

    def __init__(self, release: contextlib.ExitStack) -> None:
        self._release = release

    def close(self) -> None:
        """Release the lock. More calls do nothing."""
        self._release.close()


def lock_folder(folder: Path, wait: bool) -> FolderLock | None:
    """Lock an existing folder. None where another process holds the lock, and ``wait`` is False.

    On file systems that have no locks, the folder counts as locked. Raises OSError for a folder
    that does not exist."""
    stack = contextlib.ExitStack()
    if sys.platform == "win32":
        held = _lock_windows(folder, wait, stack)
    else:
        held = _lock_posix(folder, wait, stack)
    if not held:
        stack.close()
        return None
    return FolderLock(stack)


@contextlib.contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, after other processes have released it."""
    held = lock_folder(folder, wait=True)
    try:
        yield
    finally:
        if held is not None:
            held.close()


def _lock_posix(folder: Path, wait: bool, stack: contextlib.ExitStack) -> bool:
    import fcntl

    handle = os.open(folder, os.O_RDONLY)
    stack.callback(os.close, handle)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a network file system without locks
        return True
    return True


def _lock_windows(folder: Path, wait: bool, stack: contextlib.ExitStack) -> bool:
    """Folders cannot be opened there: a file next to the folder is locked, and deleted at the
    end."""
    import msvcrt

    if not folder.is_dir():
        raise FileNotFoundError(str(folder))
    path = folder.with_name(f"{folder.name}.lock")
    file: BinaryIO = path.open("a+b")
    stack.callback(path.unlink, missing_ok=True)
    stack.callback(file.close)
    mode = msvcrt.LK_NBLCK  # type: ignore[attr-defined]
    while True:
        file.seek(0)
        try:
            msvcrt.locking(file.fileno(), mode, 1)  # type: ignore[attr-defined]
            return True
        except OSError:
            if not wait:
                stack.pop_all().callback(file.close)
                return False
