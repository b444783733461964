"""Georeferenced meshes: reading loses no precision; precision lost in the file is reported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from patina.core.geometry.rays import RayScene
from patina.core.scan.mesh import Mesh, read_mesh
from tests import make_meshes as made
from tests.make_capture import sphere_mesh

UTM = np.array([500_000.123456, 4_649_776.654321, 123.987654])


def exact_ball() -> tuple[np.ndarray, np.ndarray]:
    """A ball whose coordinates, and their sums with integers below 2^23, are exact in binary."""
    vertices, faces = sphere_mesh(3)
    return np.round(vertices * 2**20) / 2**20, faces.astype(np.int32)


@pytest.mark.parametrize("name", ["m.obj", "ascii.ply", "little.ply", "big.ply"])
def test_coordinates_are_read_to_last_bit(tmp_path: Path, name: str) -> None:
    """Nine decimals next to an offset of 4.6 million, to the last bit of a double."""
    vertices, faces = sphere_mesh(1)
    far = vertices * 1e-3 + UTM  # an object of 2 mm
    if name == "m.obj":
        content = made.obj_text(far, faces).encode()
        expected = np.array([[float(f"{x:.9f}") for x in row] for row in far])
    elif name == "ascii.ply":
        content = made.ply_bytes(np.zeros((0, 3)), faces, form="ascii", coordinate="float")
        rows = "".join(" ".join(f"{x:.9f}" for x in row) + "\n" for row in far)
        content = content.replace(b"element vertex 0", b"element vertex %d" % len(far))
        content = content.replace(b"end_header\n", b"end_header\n" + rows.encode())
        expected = np.array([[float(f"{x:.9f}") for x in row] for row in far])
    else:
        form = {"little.ply": "binary_little_endian", "big.ply": "binary_big_endian"}[name]
        content, expected = made.ply_bytes(far, faces, form=form), far
    (tmp_path / name).write_bytes(content)
    mesh = read_mesh(tmp_path / name)
    assert np.array_equal(mesh.vertices[mesh.faces], expected[faces])
    assert mesh.notes == ()


@pytest.mark.parametrize("name", ["m.stl", "m.glb", "m.ply"])
@pytest.mark.parametrize(("away", "lost"), [(0.0, False), (500.0, False), (5e6, True)])
def test_precision_lost_in_float32_is_reported(
    tmp_path: Path, name: str, away: float, lost: bool
) -> None:
    vertices, faces = sphere_mesh(1)
    far = vertices + away
    content = {
        "m.stl": lambda: made.stl_bytes(far, faces),
        "m.glb": lambda: made.simple_gltf(far, faces).glb(),
        "m.ply": lambda: made.ply_bytes(far, faces, coordinate="float"),
    }[name]()
    (tmp_path / name).write_bytes(content)
    mesh = read_mesh(tmp_path / name)
    assert bool(mesh.notes) == lost
    if lost:
        assert "32 bits" in mesh.notes[0] and "5e+06" in mesh.notes[0]
    off = np.abs(mesh.vertices[mesh.faces[0]] - far[faces[0]]).max()
    assert (off > 1e-4 * 2 * 3**0.5) <= lost


def test_gltf_node_translation_keeps_precision(tmp_path: Path) -> None:
    """Local coordinates in float32 under a translation in doubles: nothing is lost."""
    vertices, faces = sphere_mesh(1)
    writer = made.simple_gltf(vertices, faces)
    writer.document["nodes"][0]["translation"] = UTM.tolist()
    (tmp_path / "m.glb").write_bytes(writer.glb())
    mesh = read_mesh(tmp_path / "m.glb")
    assert mesh.notes == ()
    stored = vertices.astype(np.float32).astype(np.float64)
    assert np.abs(mesh.vertices[mesh.faces] - (stored + UTM)[faces]).max() < 2e-9


@pytest.mark.parametrize("offset", [(5e6, -5e6, 5e6), (5e6, 0.0, 0.0)])
def test_geometry_far_from_origin_equals_that_at_origin(offset: tuple[float, float, float]) -> None:
    vertices, faces = exact_ball()
    near, far = Mesh(vertices, faces), Mesh(vertices + offset, faces)
    assert far.size == near.size
    assert np.abs(far.vertex_normals - near.vertex_normals).max() < 1e-12
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(2000, 3))
    directions[:, 2] -= 3
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    eye = np.array([0.25, -0.25, 4.0])
    scenes = RayScene.build(near), RayScene.build(far)
    a = scenes[0].first_hits(eye, directions)
    b = scenes[1].first_hits(eye + offset, directions)
    assert (a.face >= 0).sum() > 300
    same = a.face == b.face  # a ray through an edge may hit either of its faces
    assert same.mean() > 0.999
    hit = same & (a.face >= 0)
    a, b = (type(a)(*(column[hit] for column in hits)) for hits in (a, b))
    points = scenes[0].points(a), scenes[1].points(b) - offset
    normals = scenes[0].normals(a), scenes[1].normals(b)
    # rays are cast in float32 about the mesh's middle, wherever that is
    assert np.abs(points[0] - points[1]).max() < 2e-6 * near.size
    assert np.abs(normals[0] - normals[1]).max() < 1e-5
