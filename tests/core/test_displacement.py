"""The tilts of a known relief give back its height, and the displaced mesh its normals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.errors import PatinaError
from patina.core.scan import Mesh
from patina.core.scan.mesh import read_mesh
from patina.core.scan.mesh_formats.write_ply import write_ply
from patina.core.varying.displacement import displaced_mesh, heights, integrable_tilts
from patina.core.varying.node_model import COUNT, TILT
from patina.core.varying.surface_grid import SurfaceGrid
from patina.core.varying.varying_surface import MaterialVariation, VaryingSurface

CELLS, DIVISIONS = 16, 7
DEPTH, WAVES = 0.004, 6.0  # of the relief, on a square of side 1; cells are 1/16 wide


def square(seam: bool = False) -> Mesh:
    """A flat square; with ``seam`` its halves have vertices and texture of their own."""
    x, y = np.meshgrid(np.linspace(0, 1, CELLS + 1), np.linspace(0, 1, CELLS + 1))
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    row, column = (a.ravel() for a in np.indices((CELLS, CELLS)))
    a = row * (CELLS + 1) + column
    faces = np.concatenate(
        [np.stack([a, a + 1, a + CELLS + 2], 1), np.stack([a, a + CELLS + 2, a + CELLS + 1], 1)]
    )
    uv = points[:, :2][faces].astype(np.float32)
    if seam:
        right = points[faces].mean(axis=1)[:, 0] > 0.5
        faces = np.where(right[:, None], faces + len(points), faces)
        points = np.concatenate([points, points])
        uv = 0.4 * uv + 0.5 * right[:, None, None].astype(np.float32)
    return Mesh(points, faces.astype(np.int32), uv=uv)


def relief(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(height (n,), gradient (n, 3)) of waves along both sides."""
    k = 2 * np.pi * WAVES
    x, y = k * points[:, 0], k * points[:, 1]
    height = DEPTH * np.sin(x) * np.sin(y)
    slope = DEPTH * k * np.stack([np.cos(x) * np.sin(y), np.sin(x) * np.cos(y), 0 * x], axis=1)
    return height, slope


def tilted_surface(mesh: Mesh) -> VaryingSurface:
    grid = SurfaceGrid.of(mesh, DIVISIONS)
    parameters = np.zeros((len(grid), COUNT), np.float32)
    parameters[:, TILT] = -relief(grid.points(slice(None)))[1]
    photos, faces = np.ones(len(grid), np.uint16), np.zeros(len(mesh.faces), np.uint8)
    kinds = (MaterialVariation("diffuse and normals"),)
    return VaryingSurface(grid, parameters, 0 * parameters, photos, faces, kinds)


@pytest.mark.parametrize("seam", [False, True])
def test_height_is_that_of_the_relief(seam):
    surface = tilted_surface(square(seam))
    true, _ = relief(surface.grid.points(slice(None)))
    found = heights(surface)
    assert np.sqrt(np.mean((found - true) ** 2)) < 0.05 * true.std()


def test_long_slopes_do_not_move_the_mesh():
    surface = tilted_surface(square())
    everywhere = np.zeros_like(surface.parameters)
    everywhere[:, TILT.start] = 0.05  # a slope over the whole square would reach a height of 0.05
    found = heights(replace(surface, parameters=everywhere))
    assert np.abs(found).max() < 0.02


def test_slopes_of_the_height_are_the_tilts():
    surface = tilted_surface(square())
    points = surface.grid.points(slice(None))
    inner = ((points[:, :2] > 0.1) & (points[:, :2] < 0.9)).all(axis=1)
    found = integrable_tilts(surface.grid, heights(surface))[inner]
    true = surface.parameters[inner, TILT]
    # a node has the mean of the triangles around it: with 19 of them in a wave, 8 % too little
    assert np.sqrt(np.mean((found - true) ** 2)) < 0.09 * true.std()


def test_tilts_that_are_no_slopes_give_no_height():
    surface = tilted_surface(square())
    swirl = np.zeros_like(surface.parameters)
    _, slope = relief(surface.grid.points(slice(None)))
    swirl[:, 5], swirl[:, 6] = slope[:, 1], -slope[:, 0]  # has no divergence
    true = heights(surface)
    found = heights(replace(surface, parameters=swirl))
    assert found.std() < 0.15 * true.std()


def test_displaced_mesh_has_the_normals_and_is_read_back(tmp_path):
    surface = tilted_surface(square(seam=True))
    made = displaced_mesh(surface)
    assert len(made.faces) == DIVISIONS**2 * len(surface.grid.mesh.faces)
    assert made.area == pytest.approx(1.0, rel=0.05)
    middle = made.vertices[made.faces].mean(axis=1)
    _, slope = relief(middle)
    true = np.array([0, 0, 1.0]) - slope
    true /= np.linalg.norm(true, axis=1, keepdims=True)
    inner = ((middle[:, :2] > 0.1) & (middle[:, :2] < 0.9)).all(axis=1)
    cosine = np.einsum("ij,ij->i", made.face_normals, true)[inner]
    error = np.degrees(np.arccos(np.clip(np.median(cosine), -1, 1)))
    before = np.degrees(np.arccos(np.median(true[inner, 2])))
    assert error < 0.2 * before
    write_ply(tmp_path / "made.ply", made.vertices, made.faces, made.uv)
    read = read_mesh(tmp_path / "made.ply")
    assert read.vertices[read.faces] == pytest.approx(made.vertices[made.faces], abs=1e-6)
    assert read.uv == pytest.approx(made.uv, abs=1e-6)


def test_surface_whose_normals_do_not_vary_is_refused():
    surface = tilted_surface(square())
    with pytest.raises(PatinaError, match="normals of this result do not vary"):
        heights(replace(surface, parameters=np.zeros_like(surface.parameters)))
