"""Read the header of a Radiance .hdr picture: the factors that its pixels were multiplied by.

G. Ward, "Radiance file formats" (filefmts): lines of text, an empty line, the resolution string.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from ..errors import InputError

MAX_HEADER_BYTES = 1 << 16
RESOLUTION = re.compile(rb"([+-])Y (\d{1,9}) ([+-])X (\d{1,9})\n")


def check_hdr(path: Path) -> tuple[float, float, float]:
    """The factors by which R, G, B must be divided to get radiance: the product of all EXPOSURE
    and COLORCORR lines.

    Raises InputError for XYZE pixels, rows that are not from top to bottom, or bad numbers.
    """
    with path.open("rb") as file:
        head = file.read(MAX_HEADER_BYTES)
    text, blank, rest = head.partition(b"\n\n")
    if not blank:
        raise InputError("has a header without an end; expected a Radiance picture", file=path)
    if b"32-bit_rle_xyze" in text:
        raise InputError("has XYZE pixels; expected 32-bit_rle_rgbe", file=path)
    shape = RESOLUTION.match(rest)
    if shape is None or shape[1] != b"-" or shape[3] != b"+":
        found = rest[:40].split(b"\n")[0].decode("latin-1")
        raise InputError(f'has the resolution {found!r}; expected "-Y HEIGHT +X WIDTH"', file=path)
    scale = [1.0, 1.0, 1.0]
    for line in text.split(b"\n"):
        key, _, value = line.partition(b"=")
        if key.strip() in (b"EXPOSURE", b"COLORCORR"):
            factors = _factors(path, value.decode("latin-1"), 1 if b"EXP" in key else 3)
            scale = [s * n for s, n in zip(scale, factors, strict=True)]
    if not all(1e-30 < s < 1e30 for s in scale):
        raise InputError(
            "has an EXPOSURE or COLORCORR out of range; expected a product of 1e-30 to 1e30",
            file=path,
        )
    return scale[0], scale[1], scale[2]


def _factors(path: Path, text: str, count: int) -> list[float]:
    """Three positive factors (R, G, B) from a header line with ``count`` numbers."""
    try:
        factors = [float(word) for word in text.split()]
    except ValueError:
        factors = []
    if len(factors) != count or not all(math.isfinite(n) and n > 0 for n in factors):
        raise InputError(
            f"has the EXPOSURE or COLORCORR {text.strip()[:40]!r}; expected positive numbers",
            file=path,
        )
    return factors * (3 // count)
