"""A staging folder for a result, which moves to its place where everything was written."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import InputError
from .folder_lock import lock_folder
from .publication import Plan, complete_publication, publish

STAGING = ".patina-part-"  # start of the names of staging folders
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
    out: Path, owner: str | None = None, say: Callable[[str], object] = lambda sentence: None
) -> Iterator[Path]:
    """A temporary folder whose files move to ``out`` if the block succeeds, and are deleted if not.

    owner: what writes them, such as "fit". Files of an earlier result of this owner are replaced or
    deleted; files that the user changed, or wrote, are kept (publication.py), and ``say`` gets a
    sentence about them. None: files of the same name are replaced, whoever wrote them. Raises
    InputError.
    """
    out = check_out(out)
    try:
        # on the same file system, so that moving is renaming
        location = out if out.is_dir() else out.parent
        location.mkdir(parents=True, exist_ok=True)
        complete_publication(out)
        _remove_abandoned(location)
        staging = location / f"{STAGING}{secrets.token_hex(4)}"
        staging.mkdir()
        held = lock_folder(staging, wait=False)
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", file=out, key="--out") from error
    try:
        yield staging
        done = publish(staging, out, owner)
    except OSError as error:
        raise InputError(f"cannot be written ({error})", file=out, key="--out") from error
    finally:
        try:
            shutil.rmtree(staging, ignore_errors=True)
        finally:
            if held is not None:
                held.close()
    if done.keep:
        say(_sentence(done, out))


def _remove_abandoned(location: Path) -> None:
    """Remove the staging folders of processes that were killed."""
    for folder in location.glob(f"{STAGING}*"):
        if folder.is_symlink() or not folder.is_dir():
            continue
        with contextlib.suppress(OSError):
            held = lock_folder(folder, wait=False)
            if held is not None:
                shutil.rmtree(folder, ignore_errors=True)
                held.close()


def _sentence(done: Plan, out: Path) -> str:
    """What happened to files of the user."""
    shown = ", ".join(done.keep[:SHOWN_FILES])
    more = len(done.keep) - SHOWN_FILES
    names = shown if more <= 0 else f"{shown} and {more} more"
    return (
        f"{names}: changed since Patina wrote it, or not written by Patina; kept in "
        f"{out / done.earlier}"
    )
