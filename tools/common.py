"""Folders, progress messages, subprocesses and the error class of the development tools."""

from __future__ import annotations

import contextlib
import ctypes
import os
import platform
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
"""Root folder of the checkout, which is also the extension."""


SIGNAL_AT_PARENT_DEATH = 1  # PR_SET_PDEATHSIG of prctl(2)


class Failure(Exception):
    """An error that is printed as one line; `code` is the exit code."""

    def __init__(self, message: str, code: int = 2) -> None:
        super().__init__(message)
        self.code = code


def say(message: str) -> None:
    """Print one line of progress on stderr; stdout is for the output of the command."""
    print(f"patina: {message}", file=sys.stderr, flush=True)


def cache_dir() -> Path:
    """Return the folder for downloads and environments; it may be deleted at any time.

    Raises Failure if it cannot be made.
    """
    if own := os.environ.get("PATINA_CACHE"):
        folder = Path(own).expanduser().resolve()
    elif sys.platform == "win32":
        folder = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData/Local")) / "patina"
    elif sys.platform == "darwin":
        folder = Path.home() / "Library/Caches/patina"
    else:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "patina"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Failure(
            f"the cache {folder} cannot be made ({error.strerror}); set PATINA_CACHE to a folder "
            "that can be written to"
        ) from error
    return folder


def this_platform() -> str:
    """Return the platform as Blender names it. Raises Failure if there are no wheels for it."""
    machine = platform.machine().lower()
    system = {"linux": "linux", "win32": "windows", "darwin": "macos"}.get(
        sys.platform, sys.platform
    )
    name = f"{system}-{'x64' if machine in ('x86_64', 'amd64') else machine}"
    if name not in ("linux-x64", "windows-x64", "macos-arm64"):
        raise Failure(
            f"found the platform {name}; Patina runs on linux-x64, windows-x64 and macos-arm64"
        )
    return name


def call(command: Sequence[str | Path], *, env: Mapping[str, str] | None = None) -> int:
    """Run a command in the user's terminal and return its exit code.

    Ctrl-C reaches the command too, and SIGTERM is passed on; it has 5 seconds to clean up before it
    is killed. On Linux it also ends where this process is killed.
    """
    words, end_too = [str(word) for word in command], None
    if sys.platform == "linux":
        libc = ctypes.CDLL(None)  # loaded before the fork

        def end_too() -> None:
            libc.prctl(SIGNAL_AT_PARENT_DEATH, signal.SIGTERM)

    process = subprocess.Popen(words, env=env and dict(env), preexec_fn=end_too)
    try:
        with _terminated_as_exception():
            code = process.wait()
    except KeyboardInterrupt as interrupt:
        if isinstance(interrupt, Terminated):
            process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=5)
        raise
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
    return code if code >= 0 else 128 - code  # ended by a signal: the exit code of a shell


class Terminated(KeyboardInterrupt):
    """The process got SIGTERM."""


@contextlib.contextmanager
def _terminated_as_exception() -> Iterator[None]:
    """Raise Terminated for SIGTERM within the block, in the main thread."""

    def raise_it(*_: object) -> None:
        raise Terminated

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, raise_it)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def quietly(
    command: Sequence[str | Path], what: str, *, env: Mapping[str, str] | None = None
) -> str:
    """Run a command without output and return its stdout.

    If it fails, print the end of its output and raise Failure; what: subject of the message.
    """
    done = subprocess.run(
        [str(word) for word in command], env=env and dict(env), capture_output=True, text=True
    )
    if done.returncode:
        lines = (done.stdout + done.stderr).strip().splitlines()
        shown = [line for line in lines if not line.startswith("WARNING: Location ")]
        print("\n".join(shown[-15:]), file=sys.stderr)
        raise Failure(f"{what} failed (exit code {done.returncode}, see above)", 1)
    return done.stdout


def megabytes(paths: Sequence[Path]) -> str:
    """Return the total size of files as text, in MB."""
    return f"{sum(path.stat().st_size for path in paths) / 1e6:.0f} MB"


@contextlib.contextmanager
def one_at_a_time(name: str) -> Iterator[None]:
    """Hold a lock in the cache, so that two processes do not set up the same folder.

    The operating system releases it when the process ends for any reason.
    """
    with (cache_dir() / f"{name}.lock").open("a+b") as handle:
        if sys.platform == "win32":
            import msvcrt

            handle.seek(0)
            while True:
                with contextlib.suppress(OSError):  # LK_LOCK gives up after ten seconds
                    msvcrt.locking(handle.fileno(), msvcrt.LK_LOCK, 1)
                    break
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
