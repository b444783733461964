"""A scan's mesh in Blender keeps its texture coordinates, colours and face attributes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

import bpy  # noqa: E402

from patina.core.scan.mesh import Mesh, read_mesh  # noqa: E402
from patina.scene.scan.meshes import create_mesh_object  # noqa: E402
from tests import make_meshes as made  # noqa: E402
from tests.make_capture import sphere_mesh  # noqa: E402


def in_blender(mesh: Mesh, origin: np.ndarray) -> bpy.types.Mesh:
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    return create_mesh_object("scan", mesh, origin, bpy.context.scene.collection).data


def column(items, name: str, width: int, kind=np.float32) -> np.ndarray:
    values = np.empty(len(items) * width, kind)
    items.foreach_get(name, values)
    return values.reshape(len(items), width)


def test_all_mesh_data_is_imported(tmp_path: Path) -> None:
    vertices, faces = sphere_mesh(2)
    rng = np.random.default_rng(3)
    colours = rng.integers(0, 256, (len(vertices), 3))
    uv = rng.random((len(faces), 3, 2))
    names = {"part": rng.integers(-5, 9, len(faces)), "material_index": np.arange(len(faces))}
    far = np.array([500_000.0, 5_000_000.0, 100.0])
    path = tmp_path / "m.ply"
    path.write_bytes(
        made.ply_bytes(
            vertices + far, faces, colours=colours, wedge_uv=uv,
            attributes={name: ("int", values.tolist()) for name, values in names.items()},
        )
    )  # fmt: skip
    data = in_blender(read_mesh(path), far)
    assert not data.validate()
    corners = column(data.loops, "vertex_index", 1, np.int32).reshape(-1, 3)
    assert np.allclose(column(data.vertices, "co", 3)[corners], vertices[faces], atol=1e-6)
    assert data.uv_layers.active.name == "UVMap"
    assert np.allclose(column(data.uv_layers["UVMap"].uv, "vector", 2), uv.reshape(-1, 2))
    seen = column(data.color_attributes["Col"].data, "color_srgb", 4)
    assert np.abs(255 * seen[corners, :3] - colours[faces]).max() < 0.51
    for name, own in (("part", "part"), ("material_index", "scan_material_index")):
        attribute = data.attributes[own]
        assert (attribute.domain, attribute.data_type) == ("FACE", "INT")
        assert np.array_equal(column(attribute.data, "value", 1, np.int32).ravel(), names[name])
    assert (column(data.polygons, "material_index", 1, np.int32) == 0).all()


def test_mesh_without_attributes_gets_none() -> None:
    vertices, faces = sphere_mesh(1)
    data = in_blender(Mesh(vertices, faces.astype(np.int32)), np.zeros(3))
    assert not data.uv_layers and not data.color_attributes
    assert len(data.polygons) == len(faces)


def test_attribute_names_reserved_by_blender() -> None:
    """A file's attribute must not become one to which Blender gives a meaning."""
    vertices, faces = sphere_mesh(1)
    mesh = Mesh(vertices, faces.astype(np.int32))
    values = np.arange(len(faces), dtype=np.int32)
    taken = ("position", "sharp_face", ".select_poly", "UVMap", "Col", "id", ".corner_vert")
    mesh = replace(
        mesh,
        face_attributes=dict.fromkeys(taken, values),
        uv=np.zeros((len(faces), 3, 2), np.float32),
        vertex_colours=np.zeros((len(vertices), 3), np.uint8),
    )
    data = in_blender(mesh, np.zeros(3))
    assert not data.validate()
    for name in taken:
        attribute = data.attributes[f"scan_{name}"]
        assert np.array_equal(column(attribute.data, "value", 1, np.int32).ravel(), values)
    assert column(data.polygons, "use_smooth", 1, bool).all()


def test_shading_is_smooth_across_seams(tmp_path: Path) -> None:
    """A GLB repeats vertices along seams; the surface in Blender has none."""
    vertices, faces = sphere_mesh(3)
    split = vertices[faces].reshape(-1, 3)
    path = tmp_path / "m.glb"
    triangles = np.arange(len(split)).reshape(-1, 3)
    path.write_bytes(made.simple_gltf(split, triangles, uv=split[:, :2]).glb())
    mesh = read_mesh(path)
    data = in_blender(mesh, np.zeros(3))
    normals = np.empty(3 * len(data.vertices), np.float32)
    data.vertex_normals.foreach_get("vector", normals)
    assert np.abs(normals.reshape(-1, 3) - mesh.vertex_normals).max() < 0.02
    assert len(data.vertices) == len(vertices)
