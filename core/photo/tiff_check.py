"""TIFFs that are refused by their tags: printers' colours, sensor mosaics, truncated files."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from .tiff_tags import Value, read_tiff_tags

PHOTOMETRIC, STRIP_OFFSETS, STRIP_BYTES, TILE_OFFSETS, TILE_BYTES = 262, 273, 279, 324, 325
REFUSED = {
    4: "a transparency mask",
    5: "CMYK colours, made for printing",
    8: "CIE L*a*b* colours",
    9: "ICC L*a*b* colours",
    10: "ITU L*a*b* colours",
    32803: "a camera's sensor mosaic (RAW)",
    34892: "a camera's linear RAW",
}


def check_tiff(path: Path) -> None:
    """Raise InputError for a TIFF whose colours are not RGB or grey, or that ends too early.

    TIFF 6.0; tags of the first directory.
    """
    with path.open("rb") as file:
        tags = read_tiff_tags(file)
    if tags is None or not tags.main:
        raise InputError("is truncated or damaged (no TIFF directory)", file=path)
    photometric = _numbers(tags.main.get(PHOTOMETRIC))
    if photometric and photometric[0] in REFUSED:
        what = REFUSED[photometric[0]]
        raise InputError(
            f"holds {what}; expected RGB or grey; export it again as RGB, or give a RAW file its "
            "own extension (.dng …)",
            file=path,
        )
    size = path.stat().st_size
    for offsets, lengths in ((STRIP_OFFSETS, STRIP_BYTES), (TILE_OFFSETS, TILE_BYTES)):
        starts, bytes_of = _numbers(tags.main.get(offsets)), _numbers(tags.main.get(lengths))
        if any(start + n > size for start, n in zip(starts, bytes_of, strict=False)):
            raise InputError("is truncated (its pixels end after the file does)", file=path)


def _numbers(value: Value | None) -> list[int]:
    numbers = value if isinstance(value, tuple) else ()
    return [number for number in numbers if isinstance(number, int)]
