"""Read the curves and primaries of an embedded ICC profile of the matrix/TRC type.

ICC.1:2022, section 8.3.3 (three-component matrix-based) and 8.4.3 (monochrome); tags curv (10.6)
and para (10.18).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from .primaries import D50_XYZ, Matrix, to_rec709
from .transfer import Curve, Parametric, Sampled, is_increasing

HEADER_BYTES, MAX_TAGS, MAX_POINTS = 128, 200, 1 << 16
# parameters g a b c d e f that each function type of 'para' has
PARAMETERS = {0: "g", 1: "gab", 2: "gabc", 3: "gabcd", 4: "gabcdef"}


@dataclass(frozen=True)
class Profile:
    """An ICC profile. curves: encoded → linear for R, G, B; matrix: (3, 3) linear file RGB →
    linear Rec.709, None where it is the identity or the profile is grey; name: its description."""

    curves: tuple[Curve, Curve, Curve]
    matrix: Matrix | None
    name: str


def read_profile(data: bytes) -> Profile | None:
    """The profile, or None where it uses look-up tables or is damaged."""
    try:
        tags = _tags(data)
        name = _description(tags.get(b"desc", b""))
        if data[16:20] == b"GRAY":
            grey = _curve(tags[b"kTRC"])
            return Profile((grey, grey, grey), None, name)
        if data[16:20] != b"RGB ":
            return None
        red, green, blue = (_curve(tags[key]) for key in (b"rTRC", b"gTRC", b"bTRC"))
        columns = np.stack([_xyz(tags[key]) for key in (b"rXYZ", b"gXYZ", b"bXYZ")], axis=1)
        return Profile((red, green, blue), to_rec709(columns, D50_XYZ), name)
    except (KeyError, ValueError, struct.error):
        return None


def _tags(data: bytes) -> dict[bytes, bytes]:
    if data[36:40] != b"acsp":
        raise ValueError("no ICC profile")
    (count,) = struct.unpack_from(">I", data, HEADER_BYTES)
    found = {}
    for place in range(min(count, MAX_TAGS)):
        key, start, size = struct.unpack_from(">4sII", data, HEADER_BYTES + 4 + 12 * place)
        found[key] = data[start : start + size]
    return found


def _curve(tag: bytes) -> Curve:
    kind = tag[:4]
    if kind == b"para":
        (function,) = struct.unpack_from(">H", tag, 8)
        return _checked(_parametric(tag, function))
    if kind != b"curv":
        raise ValueError("not a curve")
    (count,) = struct.unpack_from(">I", tag, 8)
    if count == 0:
        return Parametric(c=1.0)
    if count == 1:
        return _checked(Parametric(struct.unpack_from(">H", tag, 12)[0] / 256))
    if count > MAX_POINTS:
        raise ValueError("too many points")
    points = np.frombuffer(tag, ">u2", count, 12) / 65535.0
    return _checked(Sampled(tuple(np.linspace(0, 1, count).tolist()), tuple(points.tolist())))


def _parametric(tag: bytes, function: int) -> Curve:
    """Function types 0 … 4, converted to type 4."""
    if function not in PARAMETERS:
        raise ValueError("unknown function type")
    names = PARAMETERS[function]
    values = struct.unpack_from(f">{len(names)}i", tag, 12)
    p = dict.fromkeys("gabcdef", 0.0) | {"a": 1.0}
    p |= {name: value / 65536 for name, value in zip(names, values, strict=True)}
    if function in (1, 2):  # zero (or the constant c) below −b/a
        if p["a"] == 0:
            raise ValueError("no curve")
        p["d"] = -p["b"] / p["a"]
    if function == 2:
        p["e"] = p["f"] = p["c"]
        p["c"] = 0.0
    return Parametric(**p)


def _checked(curve: Curve) -> Curve:
    if not is_increasing(curve):
        raise ValueError("the curve does not rise")
    return curve


def _xyz(tag: bytes) -> Matrix:
    if tag[:4] != b"XYZ ":
        raise ValueError("not an XYZ tag")
    return np.array(struct.unpack_from(">3i", tag, 8)) / 65536.0


def _description(tag: bytes) -> str:
    """Text of a 'desc' (version 2) or 'mluc' (version 4) tag; empty where it cannot be read."""
    if tag[:4] == b"desc" and len(tag) >= 12:
        (length,) = struct.unpack_from(">I", tag, 8)
        text = tag[12 : 12 + min(length, 100)].split(b"\0")[0].decode("latin-1")
    elif tag[:4] == b"mluc" and len(tag) >= 28:
        length, start = struct.unpack_from(">II", tag, 20)
        text = tag[start : start + min(length, 200)].decode("utf-16-be", "ignore")
    else:
        text = ""
    return "".join(c for c in text if c.isprintable()).strip()[:60]
