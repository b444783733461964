"""Write results completely or not at all: to a temporary folder first, then moved into place."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError


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
def staged_folder(out: Path) -> Iterator[Path]:
    """A temporary folder whose files move to ``out`` if the block succeeds, and are deleted if not.

    Files of the same name are replaced; other files in ``out`` do not change. Raises InputError.
    """
    out = check_out(out)
    try:
        existed = out.is_dir()
        if not existed:
            out.parent.mkdir(parents=True, exist_ok=True)
        location = (
            out if existed else out.parent
        )  # on the same file system, so that moving is renaming
        staging = Path(tempfile.mkdtemp(prefix=".patina-part-", dir=location))
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", file=out, key="--out") from error
    try:
        yield staging
        _move(staging, out)
    except OSError as error:
        raise InputError(f"cannot be written ({error})", file=out, key="--out") from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _move(staging: Path, out: Path) -> None:
    """Move all files to ``out``, after checking that no folder or file is in their way."""
    places = [(source, out / source.relative_to(staging)) for source in sorted(staging.rglob("*"))]
    for source, target in places:
        if target.exists() and target.is_dir() != source.is_dir():
            kind = "a folder" if target.is_dir() else "a file"
            raise InputError(
                f"is {kind} that blocks a result of this name; move or rename it", file=target
            )
    for source, target in places:
        if source.is_dir():
            target.mkdir(parents=True, exist_ok=True)
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            os.replace(source, target)
