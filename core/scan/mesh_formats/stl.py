"""Reader for STL, binary and ascii: separate triangles, joined where their corners are equal in
every bit.

The StereoLithography Interface Specification (3D Systems, 1989). A file is binary where its size is
the one its count implies, because many binary files begin with the word "solid" too.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .polygons import Polygons
from .precision import float32_note
from .text_lines import TextLines, text_bytes

HEADER_BYTES, TRIANGLE_BYTES = 84, 50
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(data: bytes, path: Path) -> Polygons:
    """The triangles of an STL. Raises InputError."""
    is_text = data[:512].lstrip()[:5].lower() == b"solid"
    if len(data) >= HEADER_BYTES:
        (count,) = struct.unpack_from("<I", data, 80)
        needed = HEADER_BYTES + TRIANGLE_BYTES * count
        # a rest shorter than a triangle is accepted: some programs append a word
        if needed == len(data) or (not is_text and needed < len(data) < needed + TRIANGLE_BYTES):
            triangles = np.frombuffer(data, TRIANGLE, count, HEADER_BYTES)
            stored = triangles["corners"].reshape(-1, 3)
            return _soup(stored.astype(np.float64), float32_note(stored))
        if not is_text:
            raise InputError(
                f"its header declares {count} triangles, which take {needed} bytes; the file has "
                f"{len(data)}: it is truncated or not an STL file",
                file=path,
            )
    if not is_text:
        raise InputError("is truncated or not an STL file", file=path)
    return _ascii(data, path)


def _ascii(data: bytes, path: Path) -> Polygons:
    lines = TextLines(text_bytes(data, path).lower(), path)
    facets, ends = lines.starting_with(b"facet"), lines.starting_with(b"endfacet")
    corners = lines.starting_with(b"vertex")
    if not len(lines.starting_with(b"endsolid")) or len(facets) != len(ends):
        raise InputError("is truncated: it ends within a solid", file=path)
    # each facet has three vertices between its first and last line
    owner = np.searchsorted(facets, corners) - 1
    if len(corners) != 3 * len(facets) or (owner != np.repeat(np.arange(len(facets)), 3)).any():
        raise InputError("a facet does not have three vertices", file=path)
    values, _ = lines.table(corners, b"vertex", 3)
    return _soup(values, ())


def _soup(corners: NDArray[np.float64], notes: tuple[str, ...]) -> Polygons:
    count = len(corners) // 3
    return Polygons(corners, np.arange(3 * count), np.full(count, 3, np.int64), notes=notes)
