"""A limit on what an image declares about itself: the libraries read a value of any size."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError

MAX_METADATA_BYTES = 1 << 25
"""Of one value, such as a colour profile: those of printers have up to 4 MB, a preview 10 MB."""


def check_metadata_size(path: Path, size: int, most: int = MAX_METADATA_BYTES) -> None:
    """Raise InputError for a value of more than ``most`` bytes."""
    if size > most:
        raise InputError(
            f"declares a colour profile or other information of {size / 1e6:.0f} MB; expected at "
            f"most {most / 1e6:.0f} MB: export the photo again",
            file=path,
        )
