"""Results appear whole or not at all: they are written beside and moved into place."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError


def check_out(out: Path) -> Path:
    """The folder as an absolute path; refused at once, before any work, where it cannot be one."""
    out = Path(os.path.abspath(out))
    try:
        if out.is_symlink() and not out.exists():
            raise InputError("is a link that leads nowhere", file=out, key="--out")
        if out.exists() and not out.is_dir():
            raise InputError("is a file, expected a folder to write into", file=out, key="--out")
        nearest = next(p for p in (out, *out.parents) if p.exists())
        if not nearest.is_dir() or not os.access(nearest, os.W_OK):
            raise InputError("cannot be written", file=out, key="--out")
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", file=out, key="--out") from error
    return out


@contextmanager
def staged_folder(out: Path) -> Iterator[Path]:
    """A folder whose files move into ``out`` when the block ends well, and vanish when it does not.

    Files of the same names are replaced; whatever else lies in ``out`` stays as it is.
    """
    out = check_out(out)
    try:
        existed = out.is_dir()
        if not existed:
            out.parent.mkdir(parents=True, exist_ok=True)
        room = out if existed else out.parent  # one file system: moving is renaming
        staging = Path(tempfile.mkdtemp(prefix=".patina-part-", dir=room))
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
    """Every file to its place; first make sure that all of them have one."""
    places = [(source, out / source.relative_to(staging)) for source in sorted(staging.rglob("*"))]
    for source, target in places:
        if target.exists() and target.is_dir() != source.is_dir():
            kind = "a folder" if target.is_dir() else "a file"
            raise InputError(f"is {kind} and stands in the way of a result", file=target)
    for source, target in places:
        if source.is_dir():
            target.mkdir(parents=True, exist_ok=True)
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            os.replace(source, target)
