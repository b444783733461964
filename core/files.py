"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def atomic_path(path: Path, ending: str = ".part") -> Iterator[Path]:
    """A name in the same folder to write to; it becomes ``path`` where the block ends well.

    ending: added to the file's name meanwhile, for writers that go by it (".part.exr"). Where the
    block raises, ``path`` stays as it was and the unfinished file is removed. Raises OSError.
    """
    partial = path.with_name(path.name + ending)
    try:
        yield partial
        os.replace(partial, path)
    except BaseException:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)
        raise


def write_text_atomic(path: Path, text: str) -> None:
    """Write a text as UTF-8, as Path.write_text does. Raises OSError."""
    with atomic_path(path) as partial:
        partial.write_text(text, "utf-8")
