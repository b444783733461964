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
    """A folder beside ``out``; its entries replace those of the same name in ``out`` when the
    block ends well, and vanish when it does not."""
    out = Path(os.path.abspath(out))
    if out.exists() and not out.is_dir():
        raise InputError("is a file, expected a folder to write into", file=out, key="--out")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{out.name}.part-", dir=out.parent))
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", file=out, key="--out") from error
    try:
        yield staging
        out.mkdir(exist_ok=True)
        for entry in sorted(staging.iterdir()):
            target = out / entry.name
            if target.is_dir() and not target.is_symlink():
                shutil.rmtree(target)
            elif target.exists():
                target.unlink()
            os.replace(entry, target)
    finally:
        shutil.rmtree(staging, ignore_errors=True)
