"""The header of a Radiance .hdr picture: what its pixels were multiplied by.

G. Ward, "Radiance file formats" (filefmts): lines of text, an empty line, the resolution string.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from ..errors import InputError

LONGEST = 1 << 16
RESOLUTION = re.compile(rb"([+-])Y (\d{1,9}) ([+-])X (\d{1,9})\n")


def check_hdr(path: Path) -> tuple[float, float, float]:
    """What to divide R, G, B by to get radiance: all EXPOSURE and COLORCORR lines multiplied.

    Raises InputError for XYZE pixels, rows in another order than top to bottom, or bad numbers.
    """
    with path.open("rb") as file:
        head = file.read(LONGEST)
    text, blank, rest = head.partition(b"\n\n")
    if not blank:
        raise InputError("has no end of header; expected a Radiance picture", file=path)
    if b"32-bit_rle_xyze" in text:
        raise InputError("holds XYZE pixels; expected 32-bit_rle_rgbe", file=path)
    shape = RESOLUTION.match(rest)
    if shape is None or shape[1] != b"-" or shape[3] != b"+":
        found = rest[:40].split(b"\n")[0].decode("latin-1")
        raise InputError(f'has the resolution {found!r}; expected "-Y HEIGHT +X WIDTH"', file=path)
    scale = [1.0, 1.0, 1.0]
    for line in text.split(b"\n"):
        key, _, value = line.partition(b"=")
        if key.strip() in (b"EXPOSURE", b"COLORCORR"):
            numbers = _numbers(path, value.decode("latin-1"), 1 if b"EXP" in key else 3)
            scale = [s * n for s, n in zip(scale, numbers, strict=True)]
    if not all(1e-30 < s < 1e30 for s in scale):
        raise InputError("has an absurd EXPOSURE or COLORCORR", file=path)
    return scale[0], scale[1], scale[2]


def _numbers(path: Path, text: str, count: int) -> list[float]:
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(math.isfinite(n) and n > 0 for n in numbers):
        raise InputError(f"has a bad EXPOSURE or COLORCORR ({text.strip()[:40]!r})", file=path)
    return numbers * (3 // count)
