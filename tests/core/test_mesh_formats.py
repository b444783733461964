"""Every mesh format: a hand-written file reads back as the surface it was written from."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError
from patina.core.scan.mesh import Mesh, read_mesh
from patina.core.scan.mesh_formats import Polygons
from patina.core.scan.mesh_formats.triangulate import ear_clip, is_convex, plane_coordinates
from tests import make_meshes as made
from tests.make_capture import sphere_mesh

UV = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 0.5]], [[0.25, 0.75], [0.5, 1.0], [0.0, 1.0]]])


def saved(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def corner_positions(mesh: Mesh) -> np.ndarray:
    return mesh.vertices[mesh.faces]


@pytest.mark.parametrize("name", made.samples())
def test_all_formats_give_same_ball(tmp_path: Path, name: str) -> None:
    vertices, faces = sphere_mesh(1)
    mesh = read_mesh(saved(tmp_path, name, made.samples()[name]))
    assert np.allclose(corner_positions(mesh), vertices[faces], atol=2e-7)
    assert len(mesh.vertices) == len(vertices)  # joined, in STL too
    assert mesh.vertices.dtype == np.float64 and mesh.faces.dtype == np.int32
    assert not mesh.notes


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("coordinate", ["float", "double"])
@pytest.mark.parametrize("line_break", ["\n", "\r\n", "\r"])
def test_ply_with_everything(tmp_path: Path, form: str, coordinate: str, line_break: str) -> None:
    vertices, faces = made.two_triangles()
    colours = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [9, 8, 7]])
    content = made.ply_bytes(
        vertices, faces, form=form, coordinate=coordinate, normals=True, colours=colours,
        wedge_uv=UV, attributes={"part": ("int", [7, -3]), "quality": ("float", [0.5, 1.5])},
        texture="my skin.png", index_name="vertex_index", line_break=line_break,
        before=[10.5, 13.25],
    )  # fmt: skip
    mesh = read_mesh(saved(tmp_path, "m.ply", content))
    assert np.array_equal(corner_positions(mesh), vertices[faces])
    assert np.array_equal(mesh.vertex_colours, colours)
    assert mesh.uv is not None and np.array_equal(mesh.uv, UV.astype(np.float32))
    assert {k: v.tolist() for k, v in mesh.face_attributes.items()} == {"part": [7, -3]}
    assert mesh.textures == (tmp_path.resolve() / "my skin.png",)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_attributes_follow_their_polygons(tmp_path: Path, form: str) -> None:
    """A library that triangulates by itself drops face attributes; here every triangle inherits
    them.
    """
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]], float)
    faces = [[0, 1, 2, 3], [1, 4, 2], [4, 5, 2]]
    wedge = [np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) / 2, UV[0], UV[1]]
    content = made.ply_bytes(
        vertices, faces, form=form, attributes={"part": ("uint", [5, 6, 7])}, wedge_uv=wedge
    )
    mesh = read_mesh(saved(tmp_path, "m.ply", content))
    assert mesh.face_attributes["part"].tolist() == [5, 5, 6, 7]
    assert mesh.uv is not None
    # in the square, u and v are half of x and y
    assert np.allclose(mesh.uv[:2], corner_positions(mesh)[:2, :, :2] / 2)
    assert np.array_equal(mesh.uv[2:], UV.astype(np.float32))


def test_ply_vertex_texture_coordinates(tmp_path: Path) -> None:
    vertices, faces = made.two_triangles()
    st_pairs = vertices[:, :2] * 0.5
    mesh = read_mesh(saved(tmp_path, "m.ply", made.ply_bytes(vertices, faces, vertex_uv=st_pairs)))
    assert mesh.uv is not None and np.allclose(mesh.uv, st_pairs[faces])


def test_float_and_16_bit_colours(tmp_path: Path) -> None:
    for kind, values in (("float", "1.0 0.5 0.0"), ("ushort", "65535 32896 0")):
        head = "ply\nformat ascii 1.0\nelement vertex 3\n"
        head += "".join(f"property float {a}\n" for a in "xyz")
        head += "".join(f"property {kind} {c}\n" for c in ("red", "green", "blue"))
        head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        body = "".join(f"{xyz} {values}\n" for xyz in ("0 0 0", "1 0 0", "0 1 0"))
        mesh = read_mesh(saved(tmp_path, "m.ply", f"{head}{body}3 0 1 2\n"))
        assert mesh.vertex_colours is not None
        assert mesh.vertex_colours[0].tolist() == [255, 128, 0]


def test_obj_materials_textures_and_libraries(tmp_path: Path) -> None:
    vertices, faces = sphere_mesh(0)
    names = ["wire#1"] * 5 + ["grüner Lack"] * 10 + ["wire#1"] * 5
    content = made.obj_text(vertices, faces, materials=names, lib="my lib.mtl")
    path = saved(tmp_path, "m.obj", content)
    mesh = read_mesh(path)  # no material library at all
    assert mesh.face_materials == ("wire#1", "grüner Lack") and mesh.textures == ()
    assert mesh.face_attributes["material"].tolist() == [0] * 5 + [1] * 10 + [0] * 5
    saved(
        tmp_path,
        "my lib.mtl",
        "newmtl grüner Lack\nKd 1 1 1\nmap_Kd -s 2 2 1 -clamp on tex/lack 2.png\nnewmtl other\n"
        "map_Kd other.png\n",
    )
    mesh = read_mesh(path)
    assert mesh.textures == (None, tmp_path.resolve() / "tex" / "lack 2.png")


def test_obj_faces_before_first_material_have_none(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nusemtl a\nf 1 3 4\n"
    mesh = read_mesh(saved(tmp_path, "m.obj", text))
    assert mesh.face_attributes["material"].tolist() == [-1, 0]


@pytest.mark.parametrize(
    "style", ["{v}", "{v}/{t}", "{v}//{n}", "{v}/{t}/{n}", "{v}/{t}/", "{v}//"]
)
def test_all_obj_corner_notations(tmp_path: Path, style: str) -> None:
    vertices, faces = made.two_triangles()
    lines = [f"  v\t{x} {y} {z}  # where" for x, y, z in vertices]
    lines += [f"vt {u} {v} 0" for u, v in vertices[:, :2]] + ["vn 0 0 1"]
    for a, b, c in faces + 1:
        corner = [style.format(v=i, t=i, n=1) for i in (a, b, c)]
        lines.append(f"f {corner[0]} {corner[1]} \\\r\n   {corner[2]}")
    mesh = read_mesh(saved(tmp_path, "m.obj", "\ufeff" + "\r\n".join(lines) + "\r\n"))
    assert np.array_equal(corner_positions(mesh), vertices[faces])
    assert (mesh.uv is not None) == ("{t}" in style)
    if mesh.uv is not None:
        assert np.array_equal(mesh.uv, vertices[faces][..., :2].astype(np.float32))


def test_relative_indices_count_from_their_own_line(tmp_path: Path) -> None:
    """If they counted from the end of the file, both faces would be the second triangle."""
    text = (
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf -3/-3 -2/-2 -1/-1\n"
        "v 5 0 0\nv 6 0 0\nv 5 1 0\nvt .5 0\nvt .5 .5\nvt 0 .5\nf -3/-3 -2/-2 -1/-1\n"
    )
    mesh = read_mesh(saved(tmp_path, "m.obj", text))
    assert corner_positions(mesh)[:, 0, 0].tolist() == [0.0, 5.0]
    assert mesh.uv is not None and mesh.uv[1].tolist() == [[0.5, 0], [0.5, 0.5], [0, 0.5]]


def test_mixed_faces_with_and_without_texture_coordinates(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt .5 .25\nvt 1 0 0\nf 1/1 2/2 3/-1\nf 1 3 4\n"
    mesh = read_mesh(saved(tmp_path, "m.obj", text))
    assert mesh.uv is not None and "3 face corners" in mesh.notes[0]
    assert mesh.uv.tolist() == [[[0.5, 0.25], [1, 0], [1, 0]], [[0, 0]] * 3]


@pytest.mark.parametrize("scale", [1, 255])
def test_obj_vertex_colours(tmp_path: Path, scale: int) -> None:
    vertices, faces = made.two_triangles()
    colours = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [128, 64, 32]])
    text = made.obj_text(vertices, faces, colours=colours)
    if scale == 255:  # as some programs write them
        for row in colours:
            text = text.replace(" ".join(f"{c / 255:.6f}" for c in row), " ".join(map(str, row)))
    mesh = read_mesh(saved(tmp_path, "m.obj", text))
    assert np.array_equal(mesh.vertex_colours, colours)


def test_seams_do_not_split_the_surface(tmp_path: Path) -> None:
    """Formats that store one texture coordinate per vertex repeat vertices along seams."""
    vertices, faces = made.two_triangles()
    apart = vertices[faces].reshape(-1, 3)
    uv = UV.reshape(-1, 2)
    writer = made.simple_gltf(apart, [[0, 1, 2], [3, 4, 5]], uv=uv)
    for name, content in (
        ("m.glb", writer.glb()),
        ("m.ply", made.ply_bytes(apart, [[0, 1, 2], [3, 4, 5]], vertex_uv=uv)),
    ):
        mesh = read_mesh(saved(tmp_path, name, content))
        assert len(mesh.vertices) == 4 and np.array_equal(corner_positions(mesh), vertices[faces])
        assert mesh.uv is not None
        expected = UV if name == "m.ply" else UV * [1, -1] + [0, 1]  # v goes down in glTF
        assert np.allclose(mesh.uv, expected)


def test_binary_stl_that_begins_with_solid(tmp_path: Path) -> None:
    vertices, faces = sphere_mesh(0)
    content = made.stl_bytes(vertices, faces, title=b"solid facet of a CAD program")
    mesh = read_mesh(saved(tmp_path, "m.stl", content))
    assert np.allclose(corner_positions(mesh), vertices[faces], atol=1e-6)
    text = made.stl_text(vertices, faces).upper().replace("\n", "\r\n")
    mesh = read_mesh(saved(tmp_path, "m.stl", text))
    assert np.allclose(corner_positions(mesh), vertices[faces], atol=1e-8)


def turned(axis: int, degrees: float) -> np.ndarray:
    return trimesh.transformations.rotation_matrix(np.radians(degrees), np.eye(3)[axis])


def test_gltf_nodes_primitives_and_materials(tmp_path: Path) -> None:
    """Two nodes under a rotated parent; mesh 1 has two primitives; one instance is mirrored."""
    vertices, faces = sphere_mesh(0)
    writer = made.GltfWriter()
    parent = turned(0, 90) @ turned(2, 30)
    q = trimesh.transformations.quaternion_from_matrix(turned(1, 40))  # w first
    writer.document["nodes"] = [
        {"children": [1, 2, 3], "matrix": parent.T.ravel().tolist()},
        {"mesh": 0, "translation": [1, 2, 3], "rotation": [*q[1:].tolist(), float(q[0])],
         "scale": [2, 3, 4]},
        {"mesh": 1},
        {"mesh": 0, "scale": [-1, 1, 1]},
    ]  # fmt: skip
    writer.document["materials"] = [{"name": "gold"}, {}]
    writer.document["meshes"] = [
        {"primitives": [writer.primitive(vertices, faces, material=1)]},
        {"primitives": [writer.primitive(vertices + 5, faces, material=0),
                        writer.primitive(vertices - 5, faces)]},
    ]  # fmt: skip
    local = np.diag([2.0, 3, 4, 1])
    child = turned(1, 40) @ local
    child[:3, 3] = [1, 2, 3]
    for name, content in (("m.glb", writer.glb()), ("m.gltf", writer.gltf())):
        mesh = read_mesh(saved(tmp_path, name, content))
        placed = [
            (parent @ child, vertices), (parent, vertices + 5), (parent, vertices - 5),
            (parent @ np.diag([-1.0, 1, 1, 1]), vertices),
        ]  # fmt: skip
        expected = [(v @ m[:3, :3].T + m[:3, 3])[faces] for m, v in placed]
        expected[3] = expected[3][:, ::-1]  # colours outside stay outside
        assert np.allclose(corner_positions(mesh), np.concatenate(expected), atol=1e-5)
        assert mesh.face_materials == ("gold", "material 1")
        numbers = np.repeat([1, 0, -1, 1], len(faces))
        assert np.array_equal(mesh.face_attributes["material"], numbers)
        c = corner_positions(mesh)[-len(faces) :]
        centre = c.reshape(-1, 3).mean(axis=0)
        outward = np.einsum(
            "ij,ij->i", np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]), c.mean(axis=1) - centre
        )
        assert (outward > 0).all()


def test_gltf_written_by_trimesh(tmp_path: Path) -> None:
    """The surface, its area and its volume are the same as in trimesh."""
    ball = trimesh.creation.icosphere(subdivisions=2)
    box = trimesh.creation.box((1, 2, 3))
    scene = trimesh.Scene()
    scene.add_geometry(ball, transform=turned(0, 20) @ trimesh.transformations.scale_matrix(0.5))
    scene.add_geometry(box, transform=trimesh.transformations.translation_matrix([4, 5, 6]))
    scene.export(tmp_path / "s.glb")
    mesh = read_mesh(tmp_path / "s.glb")
    ours = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert ours.volume == pytest.approx(ball.volume / 8 + 6, rel=1e-5)
    assert ours.area == pytest.approx(ball.area / 4 + 22, rel=1e-5)
    assert ours.is_watertight


def test_gltf_colours_are_linear_and_textures_are_named(tmp_path: Path) -> None:
    vertices, faces = made.two_triangles()
    linear = np.full((4, 3), 0.2158605)  # sRGB 128
    writer = made.simple_gltf(vertices, faces, colours=linear, uv=np.zeros((4, 2)), material=0)
    texture = {"baseColorTexture": {"index": 0}}
    writer.document |= {
        "materials": [{"pbrMetallicRoughness": texture}],
        "textures": [{"source": 0}],
        "images": [{"uri": "the%20skin.jpg"}],
    }
    mesh = read_mesh(saved(tmp_path, "m.glb", writer.glb()))
    assert mesh.vertex_colours is not None and (mesh.vertex_colours == 128).all()
    assert mesh.textures == (tmp_path.resolve() / "the skin.jpg",)
    writer.document["images"] = [{"bufferView": 0, "mimeType": "image/png"}]
    mesh = read_mesh(saved(tmp_path, "m.glb", writer.glb()))
    assert mesh.textures == () and "inside the mesh file" in mesh.notes[0]


def test_gltf_strips_fans_and_unindexed_triangles(tmp_path: Path) -> None:
    vertices, _ = made.two_triangles()
    for mode, order, expected in (
        (4, [0, 1, 2, 0, 2, 3], [[0, 1, 2], [0, 2, 3]]),
        (5, [0, 1, 3, 2], [[0, 1, 3], [1, 2, 3]]),
        (6, [0, 1, 2, 3], [[0, 1, 2], [0, 2, 3]]),
    ):
        writer = made.GltfWriter()
        attributes = {"POSITION": writer.array(vertices[order], 5126, 3)}
        writer.document["nodes"] = [{"mesh": 0}]
        writer.document["meshes"] = [{"primitives": [{"attributes": attributes, "mode": mode}]}]
        mesh = read_mesh(saved(tmp_path, "m.glb", writer.glb()))
        c = corner_positions(mesh)
        normal = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
        assert np.allclose(normal, [0, 0, 1])  # same orientation, each half of the square
        found = sorted(tuple(sorted(map(tuple, t))) for t in c)
        assert found == sorted(tuple(sorted(map(tuple, vertices[t]))) for t in expected)


def test_gltf_quantised_and_sparse_accessors(tmp_path: Path) -> None:
    vertices, faces = made.two_triangles()
    writer = made.GltfWriter()
    position = writer.array(vertices * 32767, 5122, 3, normalized=True)
    index = writer.array(faces.ravel(), 5121, 1)
    writer.document["extensionsRequired"] = ["KHR_mesh_quantization"]
    writer.document["nodes"] = [{"mesh": 0, "scale": [10, 10, 10]}]
    primitive = {"attributes": {"POSITION": position}, "indices": index}
    writer.document["meshes"] = [{"primitives": [primitive]}]
    mesh = read_mesh(saved(tmp_path, "m.glb", writer.glb()))
    assert np.allclose(corner_positions(mesh), 10 * vertices[faces])
    writer = made.simple_gltf(vertices, faces)
    where = writer.array([2], 5123, 1)
    what = writer.array([[1, 1, 9]], 5126, 3)
    views = [writer.document["accessors"][i]["bufferView"] for i in (where, what)]
    writer.document["accessors"][0]["sparse"] = {
        "count": 1, "indices": {"bufferView": views[0], "componentType": 5123},
        "values": {"bufferView": views[1]},
    }  # fmt: skip
    mesh = read_mesh(saved(tmp_path, "m.glb", writer.glb()))
    assert corner_positions(mesh)[0, 2].tolist() == [1, 1, 9]


def test_gltf_external_buffers(tmp_path: Path) -> None:
    vertices, faces = made.two_triangles()
    folder = tmp_path / "mesh"
    (folder / "data").mkdir(parents=True)
    writer = made.simple_gltf(vertices, faces)
    path = saved(folder, "m.gltf", writer.gltf("data/b%201.bin"))
    with pytest.raises(InputError, match=r"m\.gltf.*b 1\.bin.*missing"):
        read_mesh(path)
    (folder / "data" / "b 1.bin").write_bytes(writer.binary)
    assert np.array_equal(corner_positions(read_mesh(path)), vertices[faces])
    (tmp_path / "out.bin").write_bytes(writer.binary)
    (folder / "link.bin").symlink_to(tmp_path / "out.bin")
    for uri in (
        "../out.bin",
        str(tmp_path / "out.bin"),
        "link.bin",
        "data/../../out.bin",
        "%2e%2e/out.bin",
    ):
        saved(folder, "m.gltf", writer.gltf(uri))
        with pytest.raises(InputError, match="not in the mesh's folder"):
            read_mesh(path)


@pytest.mark.parametrize(
    ("extension", "expected_text"),
    [
        ("KHR_draco_mesh_compression", "Draco"),
        ("EXT_meshopt_compression", "meshopt"),
        ("VENDOR_anything", "VENDOR_anything"),
    ],
)
def test_unsupported_gltf_extensions_are_rejected_by_name(
    tmp_path: Path, extension: str, expected_text: str
) -> None:
    writer = made.simple_gltf(*made.two_triangles())
    writer.document["extensionsRequired"] = [extension]
    with pytest.raises(InputError, match=expected_text):
        read_mesh(saved(tmp_path, "m.glb", writer.glb()))
    if expected_text != extension:
        writer = made.simple_gltf(*made.two_triangles())
        writer.document["meshes"][0]["primitives"][0]["extensions"] = {extension: {}}
        with pytest.raises(InputError, match=expected_text):
            read_mesh(saved(tmp_path, "m.glb", writer.glb()))


def star_polygon(radii: list[float]) -> np.ndarray:
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    return np.array(radii)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.2, 1.0), min_size=4, max_size=14), st.integers(0, 3))
def test_concave_polygons_are_triangulated_inside(radii: list[float], turn: int) -> None:
    """The triangles of a star-shaped polygon have its orientation, and their areas add up to its
    area.
    """
    corners = star_polygon(radii)
    lifted = np.roll(np.concatenate([corners, np.zeros((len(corners), 1))], axis=1), turn, axis=1)
    flat = plane_coordinates(lifted[None])
    x, y = corners.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    cut = flat[0][ear_clip(flat, np.array([len(corners)]))[0]]
    a, b = cut[:, 1] - cut[:, 0], cut[:, 2] - cut[:, 0]
    areas = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    assert areas.min() > -1e-9
    assert areas.sum() == pytest.approx(area, rel=1e-9)
    assert is_convex(plane_coordinates(star_polygon([1.0] * len(radii))[None] @ np.eye(2, 3)))[0]


def test_concave_quad_is_not_triangulated_as_fan(tmp_path: Path) -> None:
    """A fan from the first corner of this concave quad would cover area outside it."""
    text = "v 0 0 0\nv 2 1 0\nv 0 2 0\nv 1.5 1 0\nf 1 2 3 4\n"
    for order in ("1 2 3 4", "2 3 4 1"):
        mesh = read_mesh(saved(tmp_path, "m.obj", text.replace("1 2 3 4", order)))
        c = corner_positions(mesh)
        areas = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])[:, 2] / 2
        assert (areas > 0).all() and areas.sum() == pytest.approx(0.5)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.lists(st.floats(0.2, 1.0), min_size=3, max_size=20), min_size=1, max_size=9))
def test_concave_faces_of_many_sizes(stars: list[list[float]]) -> None:
    """The triangles of each face are consecutive and have its area."""
    rings = [star_polygon(radii) + np.array([3.0 * i, 0]) for i, radii in enumerate(stars)]
    flat = np.concatenate(rings)
    sizes = np.array([len(ring) for ring in rings])
    vertices = np.concatenate([flat, np.zeros((len(flat), 1))], axis=1)
    places, owner = Polygons(vertices, np.arange(len(flat)), sizes).triangles(Path("x.obj"))
    assert np.array_equal(owner, np.repeat(np.arange(len(sizes)), sizes - 2))
    assert np.array_equal(np.repeat(np.arange(len(sizes)), sizes)[places], owner[:, None] + [0] * 3)
    c = flat[places]
    a, b = c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]
    found = np.bincount(owner, (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2)
    expected = [
        0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) for x, y in (r.T for r in rings)
    ]
    assert np.allclose(found, expected)


def test_polygon_with_many_corners(tmp_path: Path) -> None:
    n = 5000
    angle = 2 * np.pi * np.arange(n) / n
    round_ = [f"v {np.cos(a):.12f} {np.sin(a):.12f} 0" for a in angle]
    face = "f " + " ".join(str(i + 1) for i in range(n))
    mesh = read_mesh(saved(tmp_path, "m.obj", "\n".join([*round_, face]) + "\n"))
    assert len(mesh.faces) == n - 2
    round_[::2] = [f"v {np.cos(a) / 2:.12f} {np.sin(a) / 2:.12f} 0" for a in angle[::2]]
    with pytest.raises(InputError, match="5000 corners"):
        read_mesh(saved(tmp_path, "m.obj", "\n".join([*round_, face]) + "\n"))


def test_unread_data_is_named_in_warnings(tmp_path: Path) -> None:
    for name, content, expected_text in (
        ("m.fbx", b"x", "fbx"),
        ("m.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                  b"element tristrips 1\nproperty list int int vertex_indices\nend_header\n",
         "strips"),
        ("m.glb", struct.pack("<IIIII", 0x46546C67, 1, 20, 0, 0), "version 1"),
        ("m.gltf", json.dumps({"asset": {"version": "1.0"}}).encode(), "glTF '1.0'"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=expected_text):
            read_mesh(saved(tmp_path, name, content))
