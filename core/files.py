"""Atomic writing of files: a file appears completely or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path


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
