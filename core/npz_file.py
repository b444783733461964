"""Read an .npz only up to a size: a file of 6 MB can unpack to gigabytes."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from .files import open_regular


def unpacked_bytes(archive: zipfile.ZipFile) -> int:
    """What the entries declare; zipfile reads no more of an entry than that."""
    return sum(entry.file_size for entry in archive.infolist())


@contextmanager
def open_npz(path: Path, max_bytes: int) -> Iterator[Any]:
    """The arrays of an .npz without pickled objects. max_bytes: of all, unpacked. Raises
    ValueError where they have more, and UNREADABLE_NPZ where it is no such file."""
    with open_regular(path) as file:
        with zipfile.ZipFile(file) as archive:
            declared = unpacked_bytes(archive)
        if declared > max_bytes:
            raise ValueError(
                f"it unpacks to {declared / 1e6:.0f} MB; expected at most {max_bytes / 1e6:.0f} MB"
            )
        file.seek(0)
        data = np.load(file, allow_pickle=False)
        if isinstance(data, np.ndarray):  # a single array, with an archive behind it
            raise ValueError("it is not an archive of arrays")
        with data:
            try:
                yield data
            except MemoryError as error:  # the shape of an array is damaged
                raise ValueError(f"an array is too large ({error})") from error
