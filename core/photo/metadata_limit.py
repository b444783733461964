"""A limit on what an image declares about itself: the libraries read a value of any size."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError

MAX_METADATA_BYTES = 32_000_000
"""Of one value, such as a colour profile: those of printers have up to 4 MB, a preview 10 MB."""


def check_metadata_size(path: Path, name: str, size: int, most: int = MAX_METADATA_BYTES) -> None:
    """Raise InputError for a value of more than ``most`` bytes. name: of the value."""
    if size > most:
        raise InputError(
            f"declares {name} of {size / 1e6:.1f} MB; expected at most {most / 1e6:.0f} MB: export "
            "the photo again",
            file=path,
        )
