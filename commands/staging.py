"""Results appear whole or not at all: they are written beside and moved into place."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..core.errors import InputError


@contextmanager
def staged_folder(out: Path) -> Iterator[Path]:
    """A folder whose files move into ``out`` when the block ends well, and vanish when it does not.

    Files of the same names are replaced; whatever else lies in ``out`` stays as it is.
    """
    out = Path(os.path.abspath(out))
    if out.exists() and not out.is_dir():
        raise InputError("is a file, expected a folder to write into", file=out, key="--out")
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
        for source in sorted(staging.rglob("*")):
            target = out / source.relative_to(staging)
            if source.is_dir():
                target.mkdir(parents=True, exist_ok=True)
            else:
                target.parent.mkdir(parents=True, exist_ok=True)
                os.replace(source, target)
    except OSError as error:
        raise InputError(f"cannot be written ({error})", file=out, key="--out") from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)
