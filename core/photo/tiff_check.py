"""Check a TIFF by its tags; CMYK and other colour spaces, sensor mosaics and truncated files are
rejected."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from .metadata_limit import MAX_METADATA_BYTES, check_metadata_size
from .tiff_tags import Value, read_tiff_tags

PHOTOMETRIC, STRIP_OFFSETS, STRIP_BYTES, TILE_OFFSETS, TILE_BYTES = 262, 273, 279, 324, 325
LAYERS = 37724  # ImageSourceData: the layers of Photoshop
MAX_LAYERS_BYTES = 1_000_000_000
PROFILE = 34675  # InterColorProfile
UNSUPPORTED = {  # values of PhotometricInterpretation
    4: "a transparency mask",
    5: "CMYK colours for printing",
    8: "CIE L*a*b* colours",
    9: "ICC L*a*b* colours",
    10: "ITU L*a*b* colours",
    32803: "a camera's sensor mosaic (RAW)",
    34892: "a camera's linear RAW",
}


def check_tiff(path: Path) -> None:
    """Raise InputError for a TIFF that is not RGB or grey, is truncated, or has a value of too many
    bytes (TIFF 6.0; tags of the first directory)."""
    with path.open("rb") as file:
        tags = read_tiff_tags(file)
    if tags is None or not tags.main:
        raise InputError("is truncated or damaged (no TIFF directory)", file=path)
    photometric = _integers(tags.main.get(PHOTOMETRIC))
    if photometric and photometric[0] in UNSUPPORTED:
        what = UNSUPPORTED[photometric[0]]
        raise InputError(
            f"contains {what}; expected RGB or grey: export it again as RGB, or give a RAW file "
            "its own suffix (.dng …)",
            file=path,
        )
    for tag, size in tags.sizes.items():
        most = MAX_LAYERS_BYTES if tag == LAYERS else MAX_METADATA_BYTES
        name = "a colour profile" if tag == PROFILE else f"a value (tag {tag})"
        check_metadata_size(path, name, size, most)
    size = path.stat().st_size
    for offsets, lengths in ((STRIP_OFFSETS, STRIP_BYTES), (TILE_OFFSETS, TILE_BYTES)):
        starts, byte_counts = _integers(tags.main.get(offsets)), _integers(tags.main.get(lengths))
        if any(start + n > size for start, n in zip(starts, byte_counts, strict=False)):
            raise InputError("is truncated (its pixels extend past the end of the file)", file=path)


def _integers(value: Value | None) -> list[int]:
    values = value if isinstance(value, tuple) else ()
    return [number for number in values if isinstance(number, int)]
