"""A staging folder for a result, which moves to its place where everything was written."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import InputError
from .folder_lock import lock_folder
from .publication import Kept, Owner, complete_publication, publish

STAGING = ".patina-part-"  # start of the names of staging folders
SCRATCH = "patina-scratch-"  # the same, of folders for temporary files
UNPUBLISHED = "patina-unpublished-"  # the same, of results that could not move to their places
MIN_AGE = 60.0  # seconds, of a staging folder that counts as abandoned: it is locked long before
SHOWN_FILES = 3  # names in the sentence on files of the user


def check_out(out: Path) -> Path:
    """Return the folder as an absolute path. Raises InputError if it cannot be written to."""
    out = Path(os.path.abspath(out))
    try:
        if out.is_symlink() and not out.exists():
            raise InputError(
                "is a broken link; expected a folder to write to", file=out, key="--out"
            )
        if out.exists() and not out.is_dir():
            raise InputError("is a file; expected a folder to write to", file=out, key="--out")
        nearest = next(p for p in (out, *out.parents) if p.exists())
        if not nearest.is_dir() or not os.access(nearest, os.W_OK):
            raise InputError("cannot be written to; choose another folder", file=out, key="--out")
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", file=out, key="--out") from error
    return out


@contextmanager
def staged_folder(
    out: Path, owner: Owner | None = None, say: Callable[[str], object] = lambda sentence: None
) -> Iterator[Path]:
    """A temporary folder whose files move to ``out`` if the block succeeds, and are deleted if not.

    owner: what writes them, such as "fit". Files of an earlier result of this owner are replaced or
    deleted; files that the user changed, or wrote, are kept (publication.py), and ``say`` gets a
    sentence about them. None: files of the same name are replaced, whoever wrote them. Raises
    InputError; where the result is complete but cannot move to ``out``, it stays in a folder that
    the error names.
    """
    out = check_out(out)
    try:
        # on the same file system, so that moving is renaming
        location = out if out.is_dir() else out.parent
        location.mkdir(parents=True, exist_ok=True)
        complete_publication(out)
        remove_abandoned(location)
        staging = location / f"{STAGING}{secrets.token_hex(4)}"
        staging.mkdir()
        held = lock_folder(staging)
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", file=out, key="--out") from error
    done = Kept()
    try:
        yield staging
        if held is not None:
            held.close()  # Windows does not rename a folder with an open file
        try:
            done = publish(staging, out, owner)
        except (InputError, OSError) as error:
            raise _unpublished(staging, out, error) from error
    except OSError as error:
        raise InputError(f"cannot be written ({error})", file=out, key="--out") from error
    finally:
        if held is not None:
            held.close()
        shutil.rmtree(staging, ignore_errors=True)
    if done.names:
        say(_sentence(done, out))


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """A folder for temporary files on this computer's own disk. What killed processes have left is
    removed. Raises OSError."""
    location = Path(tempfile.gettempdir())
    remove_abandoned(location, SCRATCH)
    folder = Path(tempfile.mkdtemp(prefix=SCRATCH))
    held = lock_folder(folder)
    try:
        yield folder
    finally:
        if held is not None:
            held.close()
        shutil.rmtree(folder, ignore_errors=True)


def _unpublished(staging: Path, out: Path, error: Exception) -> Exception:
    """The error of a result that cannot move to its place, with where it is. It may have taken
    hours."""
    if not staging.is_dir():
        return error  # it is published, and waits in ``out``
    kept = staging.with_name(staging.name.replace(STAGING, UNPUBLISHED))
    try:
        os.rename(staging, kept)
    except OSError:
        return error
    return InputError(f"{error}; the complete result is in {kept}", file=out, key="--out")


def remove_abandoned(location: Path, prefix: str = STAGING) -> None:
    """Remove the temporary folders in ``location`` of processes that were killed: no process has
    them locked."""
    for folder in location.glob(f"{prefix}*"):
        with contextlib.suppress(OSError):
            if folder.is_symlink() or time.time() - folder.stat().st_mtime < MIN_AGE:
                continue
            held = lock_folder(folder)
            if held is None:
                continue
            held.close()
            if held.certain:
                shutil.rmtree(folder, ignore_errors=True)


def _sentence(done: Kept, out: Path) -> str:
    """What happened to files of the user."""
    shown = ", ".join(done.names[:SHOWN_FILES])
    more = len(done.names) - SHOWN_FILES
    names = shown if more <= 0 else f"{shown} and {more} more"
    return (
        f"{names}: changed since Patina wrote it, or not written by Patina; kept in "
        f"{out / done.folder}"
    )
