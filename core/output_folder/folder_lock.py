"""Locks on folders: a locked file in the folder. The system releases it when a process ends,
however it ends."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from ..errors import InputError

LOCK = ".patina-lock"
POLL = 0.05  # seconds
MAX_WAIT = 120.0  # seconds; the files of a result are moved within one


class FolderLock:
    """A lock on a folder that this process holds. certain: False on a file system without locks,
    where other processes may hold it too."""

    def __init__(self, path: Path, handle: int, certain: bool) -> None:
        self._path, self._handle, self.certain = path, handle, certain

    def close(self) -> None:
        """Release the lock and remove its file. More calls do nothing."""
        handle, self._handle = self._handle, -1
        if handle < 0:
            return
        try:
            if sys.platform != "win32":
                self._path.unlink(missing_ok=True)
        except OSError:  # the folder was made read-only
            pass
        finally:
            os.close(handle)
        if sys.platform == "win32":
            with contextlib.suppress(OSError):  # another process has the file open
                self._path.unlink()


def lock_folder(folder: Path) -> FolderLock | None:
    """Lock an existing folder; None where another process holds the lock. Raises OSError."""
    path = folder / LOCK
    while True:
        handle = os.open(path, os.O_CREAT | os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
        found = _try_lock(handle)
        if found is None:
            os.close(handle)
            return None
        if _is_same(path, handle):
            return FolderLock(path, handle, found)
        os.close(handle)  # its holder removed the file meanwhile


@contextlib.contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, after other processes have released it. Raises InputError where
    one keeps it for longer than MAX_WAIT."""
    until = time.monotonic() + MAX_WAIT
    while (held := lock_folder(folder)) is None:
        if time.monotonic() > until:
            raise InputError(
                f"another process has been writing to it for {MAX_WAIT:.0f} s; wait until it ends, "
                "or choose another folder",
                file=folder,
            )
        time.sleep(POLL)
    try:
        yield
    finally:
        held.close()


@contextlib.contextmanager
def only_writer(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder for a long time. Raises InputError at once where another process
    holds it."""
    held = lock_folder(folder)
    if held is None:
        raise InputError(
            "another process is writing to it; wait until it ends, or choose another folder",
            file=folder,
        )
    try:
        yield
    finally:
        held.close()


def _try_lock(handle: int) -> bool | None:
    """Lock an open file without waiting. None: another process has it; False: no locks here."""
    if sys.platform == "win32":
        import msvcrt

        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        except PermissionError:
            return None
        except OSError:
            return False
        return True
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return None
    except OSError:  # a network file system without locks
        return False
    return True


def _is_same(path: Path, handle: int) -> bool:
    """Whether a path still leads to an open file."""
    if sys.platform == "win32":
        return True  # open files cannot be removed there
    try:
        return os.path.samestat(os.lstat(path), os.fstat(handle))
    except FileNotFoundError:
        return False
