"""Reader for Wavefront OBJ: v (with colours), vt, f, usemtl, mtllib.

Appendix B of the Advanced Visualizer manual (Wavefront, 1993). Vertex colours follow the
coordinates, as MeshLab, ZBrush and Metashape write them. Normals are ignored: Patina computes its
own. Groups, lines, curves and smoothing are ignored.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .mtl import read_textures
from .polygons import Polygons
from .text_lines import SPACE, TextLines, parse_numbers, text_bytes

SLASH = 47
FACE_BYTES = np.isin(np.arange(256), [*b"0123456789+-/ \t\r\n\v\f"])
# a comment after numbers; material names may contain a #
TRAILING_COMMENT = re.compile(rb"^([ \t]*(?:v|vt|f)[ \t][^#\n]*)#[^\n]*", re.MULTILINE)


def read_obj(data: bytes, path: Path) -> Polygons:
    """The polygons of an OBJ. Raises InputError."""
    data = text_bytes(data, path)
    if b"\\" in data:  # a line continued on the next
        data = data.replace(b"\\\r\n", b"   ").replace(b"\\\n", b"  ")
    if data.count(b"#") > data.count(b"\n#") + data.startswith(b"#"):
        data = TRAILING_COMMENT.sub(rb"\1", data)
    lines = TextLines(data, path)
    v_lines = lines.starting_with(b"v")
    vertices, all_values = lines.table(v_lines, b"v", 3)
    uv_lines = lines.starting_with(b"vt")
    f_lines = lines.starting_with(b"f")
    corners, places, sizes = _faces(lines, f_lines)
    corners = _zero_based(lines, corners, sizes, f_lines, v_lines, "v")
    materials, textures, material_indices, notes = _materials(lines, f_lines, path)
    corner_uv, missing = None, int((places == 0).sum())
    if missing < len(places):
        uv = lines.table(uv_lines, b"vt", 2)[0]
        corner_uv = np.zeros((len(places), 2), np.float32)
        has_uv = places != 0
        corner_uv[has_uv] = uv[_zero_based(lines, places, sizes, f_lines, uv_lines, "vt")[has_uv]]
        if missing:
            notes += (
                f"{missing} face corners of the mesh have no texture coordinates; (0, 0) is used.",
            )
    if data and not data.endswith(b"\n"):
        notes += (
            "The last line of the mesh file has no line break. If it was truncated, faces "
            "are missing.",
        )
    return Polygons(
        vertices,
        corners,
        sizes,
        {} if material_indices is None else {"material": material_indices},
        _colours(all_values),
        corner_uv,
        materials,
        textures,
        notes,
    )


def _faces(
    lines: TextLines, f_lines: NDArray[np.intp]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """(c,) vertex and (c,) texture coordinate of all corners, numbered as in the file (0: none),
    and (p,) number of corners of each face."""
    corners, places, sizes = [], [], []
    for these, text, edges in lines.chunks(f_lines, b"f"):
        if not FACE_BYTES[text].all():
            bad = np.searchsorted(edges[1], np.argmin(FACE_BYTES[text]))
            lines.refuse(int(these[bad]), "a face with corners like 1, 1/2, 1//3 or 1/2/3")
        slash = text == SLASH
        visible = text > SPACE
        corner = visible.copy()
        corner[1:] &= ~visible[:-1]
        number = visible & ~slash
        number[1:] &= ~(visible & ~slash)[:-1]
        corner_at, number_at = np.flatnonzero(corner), np.flatnonzero(number)
        sizes.append(np.searchsorted(corner_at, edges[1]) - np.searchsorted(corner_at, edges[0]))
        if (sizes[-1] < 3).any():
            lines.refuse(int(these[np.argmax(sizes[-1] < 3)]), "a face with at least 3 corners")
        text[slash] = SPACE
        values = parse_numbers(text, len(number_at), np.int64)
        if values is None:
            lines.refuse(int(these[0]), "faces of whole numbers (on this line or below)")
        slashes = np.cumsum(slash, dtype=np.int32)
        of_corner = np.cumsum(corner, dtype=np.int32)[number_at] - 1
        slot = slashes[number_at] - slashes[corner_at][of_corner]
        vertex = np.zeros(len(corner_at), np.int64)
        place = np.zeros(len(corner_at), np.int64)
        vertex[of_corner[slot == 0]] = values[slot == 0]
        place[of_corner[slot == 1]] = values[slot == 1]
        wrong = vertex == 0  # "/2" or "0": OBJ counts from 1
        if wrong.any():
            line = np.searchsorted(edges[1], corner_at[np.argmax(wrong)])
            lines.refuse(int(these[line]), "vertices numbered from 1 (or from the end: -1)")
        corners.append(vertex)
        places.append(place)
    if not corners:
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0, np.int64)
    return np.concatenate(corners), np.concatenate(places), np.concatenate(sizes)


def _zero_based(
    lines: TextLines,
    file_indices: NDArray[np.int64],
    sizes: NDArray[np.int64],
    f_lines: NDArray[np.intp],
    listed: NDArray[np.intp],
    word: str,
) -> NDArray[np.int64]:
    """Indices from 0. Negative numbers count back from the face's own line. 0 (none) becomes −1."""
    before = np.repeat(np.searchsorted(listed, f_lines), sizes) if (file_indices < 0).any() else 0
    resolved = np.where(file_indices < 0, before + file_indices, file_indices - 1)
    wrong = (file_indices != 0) & ((resolved < 0) | (resolved >= len(listed)))
    if wrong.any():
        corner = int(np.argmax(wrong))
        line = int(f_lines[np.searchsorted(np.cumsum(sizes), corner, side="right")])
        raise InputError(
            f"a face refers to {word} {file_indices[corner]}; the file has {len(listed)}",
            file=lines.path,
            line=line + 1,
        )
    return resolved


def _colours(all_values: NDArray[np.float64] | None) -> NDArray[np.uint8] | None:
    """(v, 3) colours of vertex lines with six values or seven (alpha), in 0…1 or, from some
    programs, 0…255."""
    if all_values is None or all_values.shape[1] not in (6, 7):
        return None
    rgb = all_values[:, 3:6]
    if not np.isfinite(rgb).all() or rgb.min() < 0 or rgb.max() > 255:
        return None
    return np.rint(rgb if rgb.max() > 1 else 255 * rgb).astype(np.uint8)


def _materials(
    lines: TextLines, f_lines: NDArray[np.intp], path: Path
) -> tuple[tuple[str, ...], tuple[Path | None, ...], NDArray[np.int32] | None, tuple[str, ...]]:
    """(names, textures, material index of each face (−1: none), notes)."""
    switches = lines.starting_with(b"usemtl")
    if not len(switches):
        return (), (), None, ()
    known: dict[bytes, int] = {}
    places = []
    for line in switches:
        name = lines.line(int(line))[len(b"usemtl") :].strip()
        places.append(known.setdefault(name, len(known)))
    current = np.searchsorted(switches, f_lines) - 1
    material_indices = np.where(current >= 0, np.array(places, np.int32)[current], -1).astype(
        np.int32
    )
    libraries = [
        _text(lines.line(int(line))[len(b"mtllib") :]) for line in lines.starting_with(b"mtllib")
    ]
    names = tuple(_text(name) for name in known)
    textures, notes = read_textures(path, libraries, names)
    return names, textures, material_indices, notes


def _text(name: bytes) -> str:
    """A name in UTF-8, or Latin-1 where it is not valid UTF-8."""
    try:
        return name.strip().decode("utf-8")
    except UnicodeDecodeError:
        return name.strip().decode("latin-1")
