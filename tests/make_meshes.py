"""Write meshes byte by byte in the formats that Patina reads, independent of Patina."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.make_capture import sphere_mesh

PLY_LETTERS = {"uchar": "B", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}


def two_triangles():
    """Return (vertices, faces) of a square of side 1."""
    return np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float), np.array(
        [[0, 1, 2], [0, 2, 3]]
    )


def obj_text(vertices, faces, *, uv=None, normals=False, colours=None, materials=None, lib=None):
    """Return an OBJ. uv: (f, 3, 2), one per corner; materials: one name per face."""
    lines = ["# by hand", *([f"mtllib {lib}"] if lib else []), "o part"]
    for i, row in enumerate(vertices):
        extra = "" if colours is None else " " + " ".join(f"{c / 255:.6f}" for c in colours[i])
        lines.append("v " + " ".join(f"{x:.9f}" for x in row) + extra)
    if uv is not None:
        lines += [f"vt {u:.7f} {v:.7f}" for u, v in np.reshape(uv, (-1, 2))]
    if normals:
        lines.append("vn 0 0 1")
    current = None
    for i, face in enumerate(faces):
        if materials is not None and materials[i] != current:
            current = materials[i]
            lines.append(f"usemtl {current}")
        words = []
        for k, corner in enumerate(face):
            word = str(corner + 1)
            if uv is not None:
                word += f"/{3 * i + k + 1}"
            if normals:
                word += ("" if uv is not None else "/") + "/1"
            words.append(word)
        lines.append("f " + " ".join(words))
    return "\n".join(lines) + "\n"


def ply_bytes(
    vertices,
    faces,
    *,
    form="binary_little_endian",
    coordinate="double",
    normals=False,
    colours=None,
    vertex_uv=None,
    wedge_uv=None,
    attributes=None,
    texture=None,
    index_name="vertex_indices",
    line_break="\n",
    before=(),
):
    """Return a PLY. faces: rows of any length; attributes: name → (type, values); before: an
    element with rows of floats before the vertices."""
    attributes = attributes or {}
    head = ["ply", f"format {form} 1.0", "comment by hand"]
    if texture:
        head.append(f"comment TextureFile {texture}")
    if len(before):
        head += [f"element user {len(before)}", "property float a", "property list uchar int b"]
    head.append(f"element vertex {len(vertices)}")
    head += [f"property {coordinate} {axis}" for axis in "xyz"]
    if normals:
        head += [f"property float n{axis}" for axis in "xyz"]
    if colours is not None:
        head += [f"property uchar {name}" for name in ("red", "green", "blue", "alpha")]
    if vertex_uv is not None:
        head += ["property float s", "property float t"]
    head += [f"element face {len(faces)}", f"property list uchar int {index_name}"]
    head += [f"property {kind} {name}" for name, (kind, _) in attributes.items()]
    if wedge_uv is not None:
        head.append("property list uchar float texcoord")
    head.append("end_header")
    rows = []
    for value in before:
        rows.append([("float", value), ("uchar", 2), ("int", 7), ("int", 8)])
    for i, vertex in enumerate(vertices):
        row = [(coordinate, x) for x in vertex]
        if normals:
            row += [("float", x) for x in (0.0, 0.0, 1.0)]
        if colours is not None:
            row += [("uchar", int(c)) for c in (*colours[i], 255)]
        if vertex_uv is not None:
            row += [("float", x) for x in vertex_uv[i]]
        rows.append(row)
    for i, face in enumerate(faces):
        row = [("uchar", len(face)), *(("int", int(c)) for c in face)]
        row += [(kind, values[i]) for kind, values in attributes.values()]
        if wedge_uv is not None:
            flat = np.ravel(wedge_uv[i])
            row += [("uchar", len(flat)), *(("float", x) for x in flat)]
        rows.append(row)
    text = (line_break.join(head) + line_break).encode()
    if form == "ascii":
        body = [" ".join(f"{v:.9g}" if isinstance(v, float) else str(v) for _, v in row)
                for row in rows]  # fmt: skip
        return text + (line_break.join(body) + line_break).encode()
    order = ">" if form == "binary_big_endian" else "<"
    packed = [
        struct.pack(order + "".join(PLY_LETTERS[kind] for kind, _ in row), *(v for _, v in row))
        for row in rows
    ]
    return text + b"".join(packed)


def stl_bytes(vertices, faces, title=b"by hand"):
    """Return a binary STL; the title may begin with "solid", as in files of CAD programs."""
    body = [struct.pack("<12fH", 0, 0, 0, *np.ravel(vertices[list(face)]), 0) for face in faces]
    return title.ljust(80, b" ") + struct.pack("<I", len(faces)) + b"".join(body)


def stl_text(vertices, faces):
    """Return an ASCII STL."""
    lines = ["solid by hand"]
    for face in faces:
        lines += ["  facet normal 0 0 0", "    outer loop"]
        lines += [f"      vertex {x:.9e} {y:.9e} {z:.9e}" for x, y, z in vertices[list(face)]]
        lines += ["    endloop", "  endfacet"]
    return "\n".join([*lines, "endsolid by hand"]) + "\n"


class GltfWriter:
    """Collects arrays for a glTF; ``document`` becomes the JSON."""

    def __init__(self) -> None:
        self.binary = b""
        self.document: dict = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [], "meshes": [], "accessors": [], "bufferViews": [],
        }  # fmt: skip

    def array(self, values, code, width, **more):
        """Add an accessor; return its index. code: glTF's component type."""
        kind = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}[code]
        data = np.ascontiguousarray(values, kind)
        self.document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": data.nbytes}
        )
        self.document["accessors"].append(
            {"bufferView": len(self.document["bufferViews"]) - 1, "componentType": code,
             "count": len(data), "type": {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[width],
             **more}
        )  # fmt: skip
        self.binary += data.tobytes() + bytes(-data.nbytes % 4)
        return len(self.document["accessors"]) - 1

    def primitive(self, vertices, faces, uv=None, colours=None, **more):
        """Add a primitive of triangles; colours are linear floats."""
        attributes = {"POSITION": self.array(vertices, 5126, 3)}
        if uv is not None:
            attributes["TEXCOORD_0"] = self.array(uv, 5126, 2)
        if colours is not None:
            attributes["COLOR_0"] = self.array(colours, 5126, 3)
        return {"attributes": attributes, "indices": self.array(np.ravel(faces), 5125, 1), **more}

    def glb(self) -> bytes:
        """Return a GLB: the document with its binary chunk."""
        self.document["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        size = 12 + 8 + len(text) + 8 + len(self.binary)
        return (
            struct.pack("<III", 0x46546C67, 2, size)
            + struct.pack("<II", len(text), 0x4E4F534A)
            + text
            + struct.pack("<II", len(self.binary), 0x004E4942)
            + self.binary
        )

    def gltf(self, uri: str | None = None) -> bytes:
        """Return the document, with its buffer in a file ``uri``, or else in a data URI."""
        if uri is None:
            uri = "data:application/octet-stream;base64," + base64.b64encode(self.binary).decode()
        self.document["buffers"] = [{"byteLength": len(self.binary), "uri": uri}]
        return json.dumps(self.document).encode()


def simple_gltf(vertices, faces, **more) -> GltfWriter:
    """Return a glTF with one node, one mesh and one primitive."""
    writer = GltfWriter()
    writer.document["nodes"] = [{"mesh": 0}]
    writer.document["meshes"] = [{"primitives": [writer.primitive(vertices, faces, **more)]}]
    return writer


def samples() -> dict[str, bytes]:
    """Return file name → content of a small ball, in every format."""
    vertices, faces = sphere_mesh(1)
    uv = np.tile(np.array([[0.1, 0.2], [0.3, 0.2], [0.2, 0.6]]), (len(faces), 1, 1))
    part = {"part": ("int", [i % 3 for i in range(len(faces))])}
    wedges: dict = {"wedge_uv": uv, "attributes": part, "texture": "skin.png"}
    halves = ["a" if i < 40 else "b" for i in range(len(faces))]
    made: dict[str, Callable[[], bytes]] = {
        "plain.obj": lambda: obj_text(vertices, faces).encode(),
        "skin.obj": lambda: obj_text(
            vertices, faces, uv=uv, normals=True, materials=halves, lib="skin.mtl"
        ).encode(),
        "ascii.ply": lambda: ply_bytes(vertices, faces, form="ascii", **wedges),
        "little.ply": lambda: ply_bytes(vertices, faces, **wedges),
        "big.ply": lambda: ply_bytes(vertices, faces, form="binary_big_endian", **wedges),
        "binary.stl": lambda: stl_bytes(vertices, faces),
        "ascii.stl": lambda: stl_text(vertices, faces).encode(),
        "one.glb": lambda: simple_gltf(vertices, faces).glb(),
        "one.gltf": lambda: simple_gltf(vertices, faces).gltf(),
    }
    return {name: make() for name, make in made.items()}


def write_samples(folder: Path) -> dict[str, Path]:
    """Write ``samples`` to files."""
    paths = {}
    for name, content in samples().items():
        paths[name] = folder / name
        paths[name].write_bytes(content)
    return paths
