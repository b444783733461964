"""varying.npz keeps a surface, and refuses files that are not of the result's mesh."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from patina.core.errors import InputError
from patina.core.scan import Mesh
from patina.core.varying import storage
from patina.core.varying.node_model import COUNT
from patina.core.varying.surface_grid import SurfaceGrid
from patina.core.varying.varying_surface import MaterialVariation, VaryingSurface


@pytest.fixture
def surface() -> VaryingSurface:
    made = trimesh.creation.icosphere(1)
    grid = SurfaceGrid.of(Mesh(np.asarray(made.vertices), np.asarray(made.faces, np.int32)), 3)
    rng = np.random.default_rng(0)
    values = 0.05 * rng.normal(size=(2, len(grid), COUNT)).astype(np.float32)
    photos = rng.integers(0, 20, len(grid)).astype(np.uint16)
    kinds = (MaterialVariation("diffuse", {"even": 0.5}, {"even": 0.2}),)
    faces = np.zeros(len(grid.mesh.faces), np.uint8)
    return VaryingSurface(grid, values[0], np.abs(values[1]), photos, faces, kinds)


def test_surface_is_read_back(surface, tmp_path):
    storage.write(tmp_path / storage.NAME, surface)
    found = storage.read(tmp_path / storage.NAME, surface.grid.mesh, 1)
    assert found.parameters == pytest.approx(surface.parameters, abs=1e-3)
    assert found.deviation == pytest.approx(surface.deviation, abs=1e-3)
    assert (found.photos == surface.photos).all()
    assert (found.face_material == surface.face_material).all()
    assert found.materials == surface.materials
    face, weight = np.array([3, 5]), np.array([0.2, 0.3])
    assert found.at(face, weight, weight) == pytest.approx(
        surface.at(face, weight, weight), abs=1e-3
    )


def test_file_of_another_mesh_is_refused(surface, tmp_path):
    storage.write(tmp_path / storage.NAME, surface)
    mesh = surface.grid.mesh
    with pytest.raises(InputError, match="another mesh"):
        storage.read(tmp_path / storage.NAME, Mesh(mesh.vertices * 1.01, mesh.faces), 1)
    with pytest.raises(InputError, match="other materials"):
        storage.read(tmp_path / storage.NAME, mesh, 2)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 damaged", b"not an archive"])
def test_damaged_file_is_one_sentence(surface, tmp_path, content):
    path = tmp_path / storage.NAME
    path.write_bytes(content)
    with pytest.raises(InputError, match="fit again"):
        storage.read(path, surface.grid.mesh, 1)


def test_array_of_objects_is_refused(surface, tmp_path):
    path = tmp_path / storage.NAME
    storage.write(path, surface)
    with np.load(path) as stored:
        content = dict(stored)
    content["parameters"] = np.array([{"run": "me"}], object)
    np.savez(path, **content)
    with pytest.raises(InputError, match="fit again"):
        storage.read(path, surface.grid.mesh, 1)
