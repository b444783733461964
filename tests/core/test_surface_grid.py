"""The grid of nodes on a mesh: its nodes lie on the faces, shared edges have one node, and
interpolation is exact for linear functions."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.scan import Mesh
from patina.core.varying.surface_grid import SurfaceGrid
from patina.core.varying.varying_surface import barycentric


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    made = trimesh.creation.icosphere(1)
    return Mesh(np.asarray(made.vertices), np.asarray(made.faces, np.int32))


@pytest.mark.parametrize("n", [1, 2, 3, 7])
def test_count_of_nodes_is_that_of_a_divided_surface(mesh, n):
    # of a closed surface divided n times, V' = F' / 2 + 2 (Euler)
    grid = SurfaceGrid.of(mesh, n)
    assert len(grid) == len(mesh.faces) * n**2 // 2 + 2
    assert (grid.places[0] >= 0).all()


@given(n=st.integers(1, 9), seed=st.integers(0, 1000))
@settings(max_examples=25, deadline=None)
def test_linear_functions_are_interpolated_exactly(n, seed):
    rng = np.random.default_rng(seed)
    mesh = Mesh(rng.normal(size=(5, 3)), np.array([[0, 1, 2], [2, 1, 3], [4, 3, 1]], np.int32))
    grid = SurfaceGrid.of(mesh, n)
    face = rng.integers(0, 3, 200)
    weight = rng.dirichlet([0.4] * 3, 200)
    node, share = grid.at(face, weight[:, 1], weight[:, 2])
    assert share.min() > -1e-5
    found = np.einsum("mk,mkc->mc", share, grid.points(slice(None))[node])
    expected = np.einsum("mk,mkc->mc", weight, mesh.vertices[mesh.faces[face]])
    assert found == pytest.approx(expected, abs=1e-5)


def test_barycentric_weights_give_the_point(mesh):
    rng = np.random.default_rng(1)
    face = rng.integers(0, len(mesh.faces), 100)
    weight = rng.dirichlet([1] * 3, 100)
    points = np.einsum("mk,mkc->mc", weight, mesh.vertices[mesh.faces[face]])
    second, third = barycentric(mesh, face, points)
    assert second == pytest.approx(weight[:, 1], abs=1e-9)
    assert third == pytest.approx(weight[:, 2], abs=1e-9)
