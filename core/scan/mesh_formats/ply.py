"""Reader for PLY, ascii and binary. An ascii body is first converted to binary doubles.

The format: Turk, "The PLY polygon file format" (Stanford, 1994). Texture coordinates per corner
(`property list uchar float texcoord`), `texnumber` and `comment TextureFile` as MeshLab, OpenMVS
and Metashape write them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .ply_elements import Table, read_table
from .ply_header import Element, Header, read_header
from .polygons import Polygons
from .precision import float32_note
from .text_lines import SPACE, parse_numbers, text_bytes
from .texture_path import resolve_inside

COORDINATES = ("x", "y", "z")
COLOURS = (
    ("red", "green", "blue"),
    ("diffuse_red", "diffuse_green", "diffuse_blue"),
    ("r", "g", "b"),
)
VERTEX_UV = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
FACE_LISTS = ("vertex_indices", "vertex_index")


def read_ply(data: bytes, path: Path) -> Polygons:
    """The polygons of a PLY. Raises InputError."""
    header = read_header(data, path)
    notes: list[str] = []
    body = memoryview(data)[header.size :]
    if header.is_text:
        body, elements = _as_binary(bytes(body), header, path)
    else:
        elements = header.elements
    tables = _tables(body, elements, path)
    vertex, face = tables["vertex"], tables["face"]
    declared = {
        p.name: p.declared for e in header.elements if e.name == "vertex" for p in e.properties
    }
    vertices = _vertices(vertex, path)
    if not header.is_text and all(declared[axis] == "f4" for axis in COORDINATES):
        notes += float32_note(vertices)
    name = next(n for n in FACE_LISTS if n in face.lists)
    sizes, corners = face.lists[name]
    corner_uv = _corner_uv(vertex, face, sizes, corners, notes)
    attributes = _attributes(face, header, notes)
    complete = sizes >= 3
    if not complete.all():
        notes.append(
            f"Faces with fewer than 3 corners that were left out: {int((~complete).sum())}."
        )
        kept = np.repeat(complete, sizes)
        corners, sizes = corners[kept], sizes[complete]
        corner_uv = None if corner_uv is None else corner_uv[kept]
        attributes = {key: values[complete] for key, values in attributes.items()}
    textures = _textures(header, path, notes)
    if len(textures) > 1 and "texnumber" in attributes:
        attributes.setdefault("material", attributes["texnumber"])
    return Polygons(
        vertices,
        corners,
        sizes,
        attributes,
        _colours(vertex, declared),
        corner_uv,
        (),
        textures,
        tuple(notes),
    )


def _as_binary(text: bytes, header: Header, path: Path) -> tuple[memoryview, tuple[Element, ...]]:
    """(ascii body as little-endian doubles, elements with these types)."""
    text = text_bytes(text, path)
    parts = []
    for begin in _pieces(text):
        chunk = np.frombuffer(text, np.uint8)[begin]
        visible = chunk > SPACE
        count = int(visible[:1].sum()) + int((visible[1:] & ~visible[:-1]).sum())
        values = parse_numbers(chunk, count, np.float64)
        if values is None:
            offset = begin.start
            line = header.lines + text.count(b"\n", 0, offset) + 1
            raise InputError(
                "expected numbers; found other text (on this line or below)",
                file=path,
                line=line,
            )
        parts.append(values)
    flat: NDArray[np.float64] = np.concatenate(parts) if parts else np.empty(0)
    return memoryview(flat.data).cast("B"), tuple(e.in_doubles() for e in header.elements)


def _pieces(text: bytes, chunk: int = 4 << 20) -> list[slice]:
    """Slices of a text that end at line breaks."""
    pieces, begin = [], 0
    while begin < len(text):
        end = text.find(b"\n", begin + chunk)
        end = len(text) if end < 0 else end + 1
        pieces.append(slice(begin, end))
        begin = end
    return pieces


def _tables(body: memoryview, elements: tuple[Element, ...], path: Path) -> dict[str, Table]:
    """The vertex and face tables. Elements before them are skipped."""
    wanted, tables, place = {"vertex", "face"}, {}, 0
    for element in elements:
        tables[element.name], place = read_table(body, place, element, path)
        if wanted <= set(tables):
            break
    return tables


def _vertices(vertex: Table, path: Path) -> NDArray[np.float64]:
    missing = [axis for axis in COORDINATES if axis not in vertex.scalars]
    if missing:
        raise InputError(f"its vertices lack the property {missing[0]!r}", file=path)
    return np.stack([vertex.scalars[axis].astype(np.float64) for axis in COORDINATES], axis=1)


def _colours(vertex: Table, declared: dict[str, str]) -> NDArray[np.uint8] | None:
    """(v, 3) uint8 colours, from integers of 8 or 16 bits or floats in 0…1."""
    for names in COLOURS:
        if all(name in vertex.scalars for name in names):
            rgb = np.stack([vertex.scalars[name].astype(np.float64) for name in names], axis=1)
            scale = {"u1": 1.0, "u2": 1 / 257}.get(declared[names[0]], 1.0)
            if declared[names[0]][0] == "f" and len(rgb) and np.nanmax(rgb, initial=0.0) <= 1:
                scale = 255.0
            rgb = np.nan_to_num(rgb * scale)
            return np.rint(np.clip(rgb, 0, 255)).astype(np.uint8)
    return None


def _corner_uv(
    vertex: Table,
    face: Table,
    sizes: NDArray[np.int64],
    corners: NDArray[np.int64],
    notes: list[str],
) -> NDArray[np.float32] | None:
    """(c, 2) texture coordinates of the corners, or of their vertices."""
    if "texcoord" in face.lists:
        counts, values = face.lists["texcoord"]
        if (counts == 2 * sizes).all():
            return values.reshape(-1, 2).astype(np.float32)
        notes.append(
            "The texcoord lists of the mesh do not hold two values per corner; they were not read."
        )
    for names in VERTEX_UV:
        if all(name in vertex.scalars for name in names):
            inside = (corners >= 0) & (corners < vertex.count)
            if not inside.all():
                return None  # rejected later by Polygons.check
            uv = np.stack([vertex.scalars[n].astype(np.float32) for n in names], axis=1)
            return np.asarray(uv[corners])
    return None


def _attributes(face: Table, header: Header, notes: list[str]) -> dict[str, NDArray[np.int32]]:
    """Integer properties of the faces."""
    element = next(e for e in header.elements if e.name == "face")
    found = {}
    for prop in element.properties:
        if prop.count_type is not None or prop.declared[0] == "f":
            continue
        values = face.scalars[prop.name]
        whole = values.astype(np.int64)
        if len(values) and (
            (whole != values).any() or whole.min() < -(2**31) or whole.max() >= 2**31
        ):
            notes.append(
                f"The face property {prop.name!r} does not fit into 32 bits; it was not read."
            )
            continue
        found[prop.name] = whole.astype(np.int32)
    return found


def _textures(header: Header, path: Path, notes: list[str]) -> tuple[Path | None, ...]:
    textures = tuple(resolve_inside(path, name) for name in header.textures)
    if any(texture is None for texture in textures):
        notes.append("A texture of the mesh is not in the mesh's folder. Copy it there.")
    return textures if any(textures) else ()
