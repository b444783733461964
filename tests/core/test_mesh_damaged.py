"""Damaged and hostile meshes: a one-line error that names the file, in bounded time and memory."""

from __future__ import annotations

import json
import struct
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError
from patina.core.scan.mesh import Mesh, read_mesh
from patina.core.scan.mesh_formats.texture_path import resolve_inside
from tests import make_meshes as made

SAMPLES = made.samples()
FUZZ = settings(
    max_examples=150,
    deadline=None,  # read_or_reject measures the seconds of the reader alone
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
MEMORY, FLOOR = 60, 16 << 20  # times the file's size; and what any file may take


def read_or_reject(folder: Path, name: str, content: bytes) -> Mesh | None:
    """Return the mesh, which is then valid, or None after one InputError of one line that names the
    file. Anything else fails, and so do five seconds of work or sixty times the file's size in
    memory.
    """
    path = folder / name
    path.write_bytes(content)
    tracemalloc.start()
    begin = time.process_time()
    try:
        mesh = read_mesh(path)
    except InputError as error:
        assert "\n" not in str(error) and name in str(error) and len(str(error)) < 600
        return None
    finally:
        spent = time.process_time() - begin
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert spent < 5
        assert peak < max(FLOOR, MEMORY * len(content))
    assert np.isfinite(mesh.vertices).all() and len(mesh.faces)
    assert mesh.faces.min() >= 0 and mesh.faces.max() < len(mesh.vertices)
    assert np.allclose(np.linalg.norm(mesh.vertex_normals, axis=1), 1, atol=1e-6)
    assert np.isfinite(mesh.size) and mesh.size > 0
    for values in mesh.face_attributes.values():
        assert values.shape == (len(mesh.faces),) and values.dtype == np.int32
    if mesh.uv is not None:
        assert mesh.uv.shape == (len(mesh.faces), 3, 2) and np.isfinite(mesh.uv).all()
    if mesh.vertex_colours is not None:
        assert mesh.vertex_colours.shape == mesh.vertices.shape
    return mesh


@pytest.mark.parametrize("name", SAMPLES)
def test_file_truncated_at_any_place(tmp_path: Path, name: str) -> None:
    """A truncated file is rejected; an OBJ, which has no end mark, is read with a warning or with
    the faces of its complete lines.
    """
    whole = SAMPLES[name]
    rng = np.random.default_rng(5)
    for length in rng.integers(0, len(whole) - 1, 50):
        mesh = read_or_reject(tmp_path, name, whole[:length])
        if mesh is None:
            continue
        if name.endswith(".obj"):
            cut_in_a_line = not whole[:length].endswith(b"\n")
            assert bool(mesh.notes) == cut_in_a_line
        else:
            # an ASCII file without its last line break may still be complete
            assert name.startswith("ascii") and length > len(whole) - 16


def changed(name: str, place: int, content: bytes) -> bytes:
    data = SAMPLES[name]
    place %= len(data)
    return data[:place] + content + data[place + len(content) :]


@pytest.mark.parametrize("name", SAMPLES)
@FUZZ
@given(place=st.integers(0, 1 << 20), content=st.binary(min_size=1, max_size=8))
@example(place=0, content=b"")
@example(place=12, content=b"\xff\xff\xff\xff")  # the length of a GLB's JSON
@example(place=80, content=b"\xff\xff\xff\xff")  # the count of an STL
@example(place=20, content=b"nan ")
@example(place=40, content=b"1e308 ")
@example(place=300, content=b"\x00\x00\xc0\x7f")  # NaN
@example(place=301, content=b"-99999 ")
def test_fuzz_changed_bytes(tmp_path: Path, name: str, place: int, content: bytes) -> None:
    read_or_reject(tmp_path, name, changed(name, place, content))


OBJ_WORDS = st.sampled_from(
    ["v", "vt", "vn", "f", "usemtl", "mtllib", "#", "g", "\\", "\n", "\r", "1", "-1", "0", "/",
     "//", "1/1", "1e999", "nan", "..", "9" * 30, "é", "0x1", "+", "1 2 3", "\t"]
)  # fmt: skip


@FUZZ
@given(words=st.lists(OBJ_WORDS, max_size=40))
@example(words=["v", "1 2 3", "\n"] * 3 + ["f", "1", "-1", "2"])
@example(words=["v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 \\"])
@example(words=["v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1-2 2 3"])
@example(words=["v 0 0 0\nv 1 0 0\nv 0 1 0\nf / / /"])
@example(words=["v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nv"])
@example(words=["f"])
def test_fuzz_obj_text(tmp_path: Path, words: list[str]) -> None:
    base = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1 2 3\n"
    read_or_reject(tmp_path, "m.obj", (base + " ".join(words)).encode())
    read_or_reject(tmp_path, "m.obj", " ".join(words).encode())


PLY_LINES = st.sampled_from(
    ["element vertex 3", "element face 1", "element edge 1000000000000", "element vertex -1",
     "property float x", "property double y", "property float z", "property list uchar int b",
     "property list float int c", "property list uchar int vertex_indices", "property list int",
     "property uchar red", "comment TextureFile ../x", "format ascii 1.0", "obj_info", "",
     "format binary_little_endian 1.0", "property list int double texcoord", "property int part",
     "element face 99999999999999999999", "property long q"]
)  # fmt: skip


@FUZZ
@given(lines=st.lists(PLY_LINES, max_size=16), body=st.binary(max_size=200))
@example(lines=["format binary_little_endian 1.0", "element vertex 0", "property float x",
                "element face 0", "property list uchar int vertex_indices"], body=b"")  # fmt: skip
@example(lines=["format binary_little_endian 1.0", "element vertex 1000000000000",
                "element face 1", "property list uchar int vertex_indices"],
         body=b"\x03" + bytes(12))  # fmt: skip
@example(lines=["format binary_little_endian 1.0", "element edge 9", "property list uchar int b",
                "element vertex 3", "property float x", "property float y", "property float z",
                "element face 1", "property list uchar int vertex_indices"],
         body=bytes(9 + 36) + b"\x03" + struct.pack("<3i", 0, 1, 2))  # fmt: skip
def test_fuzz_ply_headers(tmp_path: Path, lines: list[str], body: bytes) -> None:
    head = "\n".join(["ply", *lines, "end_header"]) + "\n"
    read_or_reject(tmp_path, "m.ply", head.encode() + body)
    read_or_reject(tmp_path, "m.ply", head.encode() + body.hex(" ").encode())


JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-2, 2**70) | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["count", "uri", "mesh", "nodes", "byteOffset"]), inner)
    ),
    max_leaves=8,
)
GLTF_PLACES = st.sampled_from(
    [("scene",), ("scenes",), ("scenes", 0, "nodes"), ("nodes",), ("nodes", 0),
     ("nodes", 0, "mesh"), ("nodes", 0, "matrix"), ("nodes", 0, "children"),
     ("nodes", 0, "rotation"), ("nodes", 0, "scale"), ("meshes",), ("meshes", 0),
     ("meshes", 0, "primitives"), ("meshes", 0, "primitives", 0),
     ("meshes", 0, "primitives", 0, "attributes"), ("meshes", 0, "primitives", 0, "mode"),
     ("meshes", 0, "primitives", 0, "attributes", "POSITION"),
     ("meshes", 0, "primitives", 0, "attributes", "TEXCOORD_0"),
     ("meshes", 0, "primitives", 0, "attributes", "COLOR_0"),
     ("meshes", 0, "primitives", 0, "material"), ("meshes", 0, "primitives", 0, "indices"),
     ("accessors",), ("accessors", 0, "count"), ("accessors", 0, "type"),
     ("accessors", 0, "componentType"), ("accessors", 0, "bufferView"),
     ("accessors", 0, "byteOffset"), ("accessors", 0, "sparse"), ("accessors", 1, "count"),
     ("accessors", 1, "componentType"), ("accessors", 0, "normalized"), ("bufferViews",),
     ("bufferViews", 0, "byteLength"), ("bufferViews", 0, "byteStride"),
     ("bufferViews", 0, "buffer"), ("bufferViews", 0, "byteOffset"), ("buffers", 0, "uri"),
     ("buffers", 0, "byteLength"), ("asset",), ("materials",), ("extensionsRequired",)]
)  # fmt: skip


@FUZZ
@given(place=GLTF_PLACES, value=JSON)
@example(place=("accessors", 0, "count"), value=2**40)
@example(place=("accessors", 1, "count"), value=2**63)
@example(place=("accessors", 0, "bufferView"), value=None)
@example(place=("accessors", 0, "sparse"), value={"count": 10**9, "indices": {}, "values": {}})
@example(place=("bufferViews", 0, "byteStride"), value=1)
@example(place=("bufferViews", 0, "byteOffset"), value=-8)
@example(place=("buffers", 0, "uri"), value="data:;base64,AAA")
@example(place=("buffers", 0, "uri"), value="data:" + "A" * 100_000)
@example(place=("buffers", 0, "uri"), value="file:///etc/hostname")
@example(place=("nodes", 0, "children"), value=[0])
@example(place=("nodes", 0, "matrix"), value=[float("inf")] * 16)
@example(place=("nodes", 0, "matrix"), value=[1e29] * 16)
@example(place=("materials",), value=[{"pbrMetallicRoughness": {"baseColorTexture": {}}}])
def test_fuzz_gltf_documents(tmp_path: Path, place: tuple, value: object) -> None:
    document = json.loads(SAMPLES["one.gltf"])
    holder = document
    for key in place[:-1]:
        holder = holder[key]
    holder[place[-1]] = value
    text = json.dumps(document)
    read_or_reject(tmp_path, "m.gltf", text.encode())


PLY_HEAD = (
    "ply\nformat {form} 1.0\nelement vertex {v}\nproperty float x\nproperty float y\n"
    "property float z\nelement face {f}\nproperty list {count} int vertex_indices\nend_header\n"
)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("v,f", [(10**12, 1), (3, 10**12), (10**18, 10**18), (3, 0), (0, 1)])
def test_absurd_counts_in_ply(tmp_path: Path, form: str, v: int, f: int) -> None:
    head = PLY_HEAD.format(form=form, v=v, f=f, count="uchar").encode()
    body = b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n" if form == "ascii" else bytes(36) + b"\3" + bytes(12)
    assert read_or_reject(tmp_path, "m.ply", head + body) is None


@pytest.mark.parametrize("count", [-1, 2**31 - 1, -(2**31)])
def test_absurd_list_lengths_in_ply(tmp_path: Path, count: int) -> None:
    head = PLY_HEAD.format(form="binary_little_endian", v=3, f=2, count="int").encode()
    good = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    for rows in ((3, count), (count, 3)):
        body = b"".join(struct.pack("<4i", n, 0, 1, 2) for n in rows)
        assert read_or_reject(tmp_path, "m.ply", head + good + body) is None


def test_absurd_counts_in_stl_and_glb(tmp_path: Path) -> None:
    stl = bytearray(SAMPLES["binary.stl"])
    for count in (0, 79, 81, 2**31, 2**32 - 1):
        stl[80:84] = struct.pack("<I", count)
        assert read_or_reject(tmp_path, "m.stl", bytes(stl)) is None
    glb = SAMPLES["one.glb"]
    for place in (8, 12):  # the length of all, of the JSON
        for length in (0, 7, 2**31, 2**32 - 1):
            content = glb[:place] + struct.pack("<I", length) + glb[place + 4 :]
            assert read_or_reject(tmp_path, "m.glb", content) is None


@pytest.mark.parametrize(
    "text",
    [
        "v 0 0 1e308\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 1e999\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 1e13\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 1e-300\nv 1e-300 0 0\nv 0 1e-300 0\nf 1 2 3\n",
        "v 0,5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    ],
)
def test_invalid_coordinates_are_rejected(tmp_path: Path, text: str) -> None:
    assert read_or_reject(tmp_path, "m.obj", text.encode()) is None


@pytest.mark.parametrize(
    ("face", "message"),
    [
        ("f 1 2 4", "v 4; the file has 3"),
        ("f 1 2 -4", "v -4"),
        ("f 1/9 2/1 3/1", "vt 9"),
        ("f 1 2", "at least 3 corners"),
        ("f 1 2 0", "numbered from 1"),
        ("f 1 2 x", "corners like"),
        ("f 1 2 99999999999999999999999", "the file has 3"),
    ],
)
def test_invalid_face_error_names_its_line(tmp_path: Path, face: str, message: str) -> None:
    path = tmp_path / "m.obj"
    path.write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n{face}\n")
    with pytest.raises(InputError, match=rf"m\.obj:6: .*{message}"):
        read_mesh(path)


@pytest.mark.parametrize("name", ["plain.obj", "ascii.ply", "ascii.stl"])
def test_text_in_other_encodings(tmp_path: Path, name: str) -> None:
    text = SAMPLES[name].decode()
    assert read_or_reject(tmp_path, name, text.encode("utf-16")) is None
    assert read_or_reject(tmp_path, name, text.encode("utf-32-le")) is None
    assert read_or_reject(tmp_path, name, b"\x1f\x8b" + bytes(range(256)) * 4) is None


def test_excessive_mesh_instances_are_rejected(tmp_path: Path) -> None:
    """A small file whose nodes all instance one mesh of many triangles."""
    writer = made.GltfWriter()
    count = 60_000
    vertices = np.zeros((3, 3))
    indices = writer.array(np.tile([0, 1, 2], count), 5121, 1)
    position = writer.array(vertices, 5126, 3)
    primitive = {"attributes": {"POSITION": position}, "indices": indices}
    writer.document["meshes"] = [{"primitives": [primitive] * 50}]
    writer.document["nodes"] = [{"mesh": 0}] * 1000
    writer.document["scenes"] = [{"nodes": list(range(1000))}]
    path = tmp_path / "m.glb"
    path.write_bytes(writer.glb())
    begin = time.process_time()
    with pytest.raises(InputError, match="memory"):
        read_mesh(path)
    assert time.process_time() - begin < 5


def test_accessors_without_buffer_count_towards_limit(tmp_path: Path) -> None:
    """An accessor without a bufferView is all zeros, of any length that the document requests."""
    writer = made.simple_gltf(*made.two_triangles())
    writer.document["accessors"][0] = {"componentType": 5126, "count": 2**45, "type": "VEC3"}
    assert read_or_reject(tmp_path, "m.glb", writer.glb()) is None


def test_slow_to_parse_files_are_bounded(tmp_path: Path) -> None:
    """Self-intersecting faces of all sizes, unused rows, and very many nodes and materials."""
    rng = np.random.default_rng(0)
    vertices = "".join(f"v {x:.3f} {y:.3f} 0\n" for x, y in rng.random((300, 2)))
    faces = [rng.permutation(300)[:n] + 1 for n in range(4, 256)]
    text = vertices + "".join("f " + " ".join(map(str, face)) + "\n" for face in faces)
    read_or_reject(tmp_path, "m.obj", text.encode())
    read_or_reject(tmp_path, "m.obj", (text * 20).encode())
    read_or_reject(tmp_path, "m.obj", (vertices + "f " + "1 2 3 " * 200_000).encode())
    head = PLY_HEAD.format(form="binary_little_endian", v=3, f=1, count="uchar")
    edges = "element edge 400000\nproperty list uchar uchar b\nelement vertex"
    read_or_reject(
        tmp_path, "m.ply", head.replace("element vertex", edges).encode() + b"\1" * 10**6
    )
    many = {"asset": {"version": "2.0"}, "nodes": [{}] * 300_000}
    assert read_or_reject(tmp_path, "m.gltf", json.dumps(many).encode()) is None
    switches = "".join(f"usemtl {i}\nf 1 2 3\n" for i in range(20_000))
    library = "".join(f"newmtl {i}\nmap_Kd {i}.png\n" for i in range(20_000))
    (tmp_path / "m.mtl").write_text(library)
    read_or_reject(tmp_path, "m.obj", f"mtllib m.mtl\n{vertices}{switches}".encode())


def test_deeply_nested_json_and_node_trees(tmp_path: Path) -> None:
    assert read_or_reject(tmp_path, "m.gltf", b"[" * 200_000) is None
    assert read_or_reject(tmp_path, "m.gltf", b'{"a":' * 200_000) is None
    writer = made.simple_gltf(*made.two_triangles())
    depth = 5_000
    writer.document["nodes"] = [{"children": [i + 1]} for i in range(depth)] + [{"mesh": 0}]
    assert read_or_reject(tmp_path, "m.glb", writer.glb()) is not None
    writer.document["nodes"][-1] = {"children": [0]}
    assert read_or_reject(tmp_path, "m.glb", writer.glb()) is None


def test_paths_outside_mesh_folder_are_not_followed(tmp_path: Path) -> None:
    """Neither a library nor a texture is followed out of the mesh's folder, nor is it an error."""
    folder = tmp_path / "scan"
    folder.mkdir()
    secret = "newmtl a\nmap_Kd inside.png\n"
    (tmp_path / "out.mtl").write_text(secret)
    text = made.obj_text(*made.two_triangles(), materials=["a", "a"], lib="LIB")
    path = folder / "m.obj"
    for lib in ("../out.mtl", str(tmp_path / "out.mtl"), "C:\\x\\out.mtl", "..\\out.mtl"):
        path.write_text(text.replace("LIB", lib))
        mesh = read_mesh(path)
        assert mesh.textures == () and "out.mtl" in mesh.notes[0]
    path.write_text(text.replace("LIB", "out.mtl"))
    (folder / "out.mtl").write_text("newmtl a\nmap_Kd ../../x.png\n")
    mesh = read_mesh(path)
    assert mesh.textures == () and "x.png" in mesh.notes[-1]
    (folder / "out.mtl").write_text(secret.replace("inside", "/home/someone/skin"))
    (folder / "skin.png").write_bytes(b"")
    path.write_text(text.replace("LIB", "C:\\project\\out.mtl"))
    assert read_mesh(path).textures == (folder.resolve() / "skin.png",)
    (folder / "out.mtl").write_bytes(b"\xff\x00map_Kd" * 100)
    assert read_mesh(path).textures == ()


@given(name=st.text(max_size=40))
@example(name="../x")
@example(name="a/../../x")
@example(name="\0")
@example(name="~/x")
@example(name="x" * 5000)
@example(name="//server/share/x.png")
def test_fuzz_file_names(name: str) -> None:
    here = Path(__file__)
    found = resolve_inside(here, name)
    assert found is None or here.parent.resolve() in found.parents


def test_paths_that_are_not_files(tmp_path: Path) -> None:
    (tmp_path / "d.glb").mkdir()
    (tmp_path / "e.stl").write_bytes(b"")
    for name, says in (("d.glb", "not a file"), ("e.stl", "empty"), ("none.ply", "not a file")):
        with pytest.raises(InputError, match=says):
            read_mesh(tmp_path / name)
