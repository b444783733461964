"""Reader for glTF 2.0 (.gltf, .glb): the triangles of the default scene, in the scene's frame.

Khronos Group, glTF 2.0 specification (2021). The frame is that of the file, with y up; it is not
converted. Vertex colours (COLOR_0) are linear in glTF and sRGB in a Mesh. The v texture coordinate
points down in glTF and up in a Mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from .gltf_buffers import COMPRESSED, Gltf
from .gltf_nodes import placed_meshes
from .polygons import Polygons
from .precision import float32_note
from .texture_path import MOST_TEXTURES, resolve_inside

MAX_PARTS = 20_000  # primitives of all nodes
POINTS, LINES, TRIANGLES, STRIP, FAN = 0, (1, 2, 3), 4, 5, 6


@dataclass(frozen=True)
class _Part:
    """One primitive of one node: vertices (v, 3), triangles (t, 3), uv (v, 2), linear colours (v,
    3)."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    uv: NDArray[np.float32] | None
    colours: NDArray[np.float32] | None
    material: int


def read_gltf(data: bytes, path: Path) -> Polygons:
    """The triangles of all meshes of a glTF or GLB. Raises InputError."""
    document = Gltf(data, path)
    notes: dict[str, None] = {}
    parts = []
    for mesh, matrix in placed_meshes(document):
        primitives = document.member(document.entry("meshes", mesh), "primitives", list, [])
        for primitive in primitives:
            if not isinstance(primitive, dict):
                raise document.error(f"glTF: meshes[{mesh}] has a primitive that is not an object")
            part = _part(document, primitive, matrix, notes)
            if part is not None:
                parts.append(part)
            if len(parts) > MAX_PARTS:
                raise document.error(f"glTF: its scene has more than {MAX_PARTS} primitives")
    materials, textures = _materials(document, notes)
    return _joined(parts, materials, textures, tuple(notes))


def _part(
    document: Gltf, primitive: dict, matrix: NDArray[np.float64], notes: dict[str, None]
) -> _Part | None:
    for name in document.member(primitive, "extensions", dict, {}):
        if name in COMPRESSED:
            document.refuse_compressed(name)
    mode = document.member(primitive, "mode", int, TRIANGLES)
    if mode == POINTS or mode in LINES:
        return None
    attributes = document.member(primitive, "attributes", dict, {})
    if "POSITION" not in attributes:
        return None
    stored = document.accessor(attributes["POSITION"], 3)
    count = len(stored)
    if stored.dtype == np.float32:
        notes.update(dict.fromkeys(float32_note(stored)))
    if "indices" in primitive:
        corners = document.accessor(primitive["indices"], 1)[:, 0]
        if corners.dtype.kind != "u":
            raise document.error("glTF: its indices are not whole numbers")
        corners = corners.astype(np.int64)
        if len(corners) and corners.max() >= count:
            raise document.error("glTF: an index refers to a missing vertex")
    else:
        corners = np.arange(count)
    document.spend(8 * len(corners) + 24 * count)
    triangles = _triangles(corners, mode)
    if np.linalg.det(matrix[:3, :3]) < 0:  # a mirrored node reverses the orientation of its faces
        triangles = triangles[:, ::-1]
    vertices = stored.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    material = document.member(primitive, "material", int, -1)
    entry = {} if material < 0 else document.entry("materials", material)
    uv = _of_vertices(document, attributes, f"TEXCOORD_{_uv_set(document, entry)}", 2, count)
    colours = _of_vertices(document, attributes, "COLOR_0", 3, count)
    if "JOINTS_0" in attributes or primitive.get("targets"):
        notes["The mesh is animated (skin or morph targets). It was read in its rest pose."] = None
    return _Part(vertices, triangles, uv, colours, material)


def _triangles(corners: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """(t, 3) of a triangle list, a strip (every second triangle is reversed) or a fan."""
    if mode == TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if len(corners) < 3:
        return np.empty((0, 3), np.int64)
    if mode == FAN:
        first = np.full(len(corners) - 2, corners[0])
        return np.stack([corners[1:-1], corners[2:], first], axis=1)
    strip = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    strip[1::2] = strip[1::2, [0, 2, 1]]
    return strip


def _of_vertices(
    document: Gltf, attributes: dict, name: str, width: int, count: int
) -> NDArray[np.float32] | None:
    if name not in attributes:
        return None
    values = document.accessor(attributes[name], width)
    if len(values) != count:
        raise document.error(f"glTF: {name} has {len(values)} entries for {count} vertices")
    return values.astype(np.float32)


def _uv_set(document: Gltf, material: dict) -> int:
    """Index of the texture coordinates that the material's base colour uses."""
    texture = _base_texture(document, material)
    return document.member(texture, "texCoord", int, 0)


def _base_texture(document: Gltf, material: dict) -> dict:
    metallic = document.member(material, "pbrMetallicRoughness", dict, {})
    found: dict = document.member(metallic, "baseColorTexture", dict, {})
    return found


def _materials(
    document: Gltf, notes: dict[str, None]
) -> tuple[tuple[str, ...], tuple[Path | None, ...]]:
    """(names, base colour textures), in the file's order."""
    names, textures = [], []
    for index in range(len(document.member(document.json, "materials", list, []))):
        entry = document.entry("materials", index)
        names.append(document.member(entry, "name", str, f"material {index}"))
        texture = _base_texture(document, entry) if index < MOST_TEXTURES else {}
        textures.append(_texture(document, texture, notes) if texture else None)
    return tuple(names), tuple(textures) if any(textures) else ()


def _texture(document: Gltf, texture: dict, notes: dict[str, None]) -> Path | None:
    if "KHR_texture_transform" in document.member(texture, "extensions", dict, {}):
        notes["The mesh transforms its textures (KHR_texture_transform), which was ignored."] = None
    source = document.entry("textures", texture.get("index")).get("source")
    if source is None:
        return None
    uri = document.member(document.entry("images", source), "uri", str, None)
    if uri is None or uri.startswith("data:"):
        notes["Textures inside the mesh file were not read."] = None
        return None
    found = resolve_inside(document.path, unquote(uri))
    if found is None:
        notes["A texture of the mesh is not in the mesh's folder. Copy it there."] = None
    return found


def _joined(
    parts: list[_Part],
    materials: tuple[str, ...],
    textures: tuple[Path | None, ...],
    notes: tuple[str, ...],
) -> Polygons:
    if not parts:
        no_corners = np.empty(0, np.int64)
        return Polygons(np.empty((0, 3)), no_corners, no_corners)
    sizes = [len(part.vertices) for part in parts]
    offsets = np.cumsum(sizes) - sizes
    triangles = np.concatenate([p.triangles + n for p, n in zip(parts, offsets, strict=True)])
    colours = uv = None
    if all(part.colours is not None for part in parts):
        colours = _srgb(np.concatenate([p.colours for p in parts if p.colours is not None]))
    if any(part.uv is not None for part in parts):
        per_vertex = np.concatenate(
            [np.zeros((n, 2), np.float32) if p.uv is None else p.uv
             for p, n in zip(parts, sizes, strict=True)]
        )  # fmt: skip
        uv = per_vertex[triangles.ravel()]
        uv[:, 1] = 1 - uv[:, 1]
    attributes = {}
    if materials:
        material = [np.full(len(p.triangles), p.material, np.int32) for p in parts]
        attributes["material"] = np.concatenate(material)
    return Polygons(
        np.concatenate([part.vertices for part in parts]),
        triangles.ravel(),
        np.full(len(triangles), 3, np.int64),
        attributes,
        colours,
        uv,
        materials,
        textures,
        notes,
    )


def _srgb(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """8-bit sRGB (IEC 61966-2-1) of linear colours in 0…1."""
    x = np.clip(np.nan_to_num(linear), 0, 1)
    curved = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return np.rint(255 * curved).astype(np.uint8)
