"""Interreflections between the faces of a mesh, compared with exact solutions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from patina.core.diagnose.forward.radiosity import BEHIND, BOUNCES, bounced_radiance, visible_faces
from patina.core.geometry import RayScene
from patina.core.scan import Mesh
from tests.make_lit_ball import lit_ball


def rays_of(vertices: np.ndarray, faces: np.ndarray) -> RayScene:
    return RayScene.build(Mesh(np.asarray(vertices, float), np.asarray(faces, np.int32)))


def two_squares(apart: float, cells: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of two unit squares that face each other, the lower one first."""
    line = np.linspace(0, 1, cells + 1)
    x, y = np.meshgrid(line, line, indexing="ij")
    index = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])
    up = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    lower = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    return (
        np.concatenate([lower, lower + np.array([0, 0, apart])]),
        np.concatenate([up, up[:, ::-1] + len(lower)]),
    )


@pytest.mark.parametrize(("apart", "factor"), [(1.0, 0.1998), (0.5, 0.4153), (2.0, 0.0686)])
def test_view_factor_of_two_squares(apart, factor):
    """View factors of unit squares (Howell, A Catalog of Radiation Configuration Factors, C-11)."""
    vertices, faces = two_squares(apart)
    visible = visible_faces(rays_of(vertices, faces))
    half = len(faces) // 2
    np.testing.assert_allclose((visible[:half] >= half).mean(), factor, atol=0.012)
    np.testing.assert_allclose(
        ((visible[half:] >= 0) & (visible[half:] < half)).mean(), factor, atol=0.012
    )


@pytest.mark.parametrize("albedo", [0.2, 0.6, 0.95])
def test_radiosity_inside_a_sphere_is_a_geometric_series(albedo):
    """Inside a sphere all faces see each other equally: radiosity = emission · Σ albedoᵏ."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    visible = visible_faces(rays_of(ball.vertices, ball.faces[:, ::-1]))
    assert (visible >= 0).all()
    emitted = np.tile(np.float32([1.0, 0.5, 0.1]), (len(visible), 1))
    found = bounced_radiance(emitted, np.full((len(visible), 3), albedo, np.float32), visible)
    expected = emitted * (1 - albedo**BOUNCES) / (1 - albedo)
    np.testing.assert_allclose(found, expected, rtol=1e-4)


def test_back_faces_contribute_no_light():
    """Faces seen from behind (the upper square is flipped) contribute no light."""
    vertices, faces = two_squares(1.0)
    half = len(faces) // 2
    faces[half:] = faces[half:, ::-1]
    visible = visible_faces(rays_of(vertices, faces))
    assert (visible < 0).all()
    np.testing.assert_allclose((visible[:half] == BEHIND).mean(), 0.1998, atol=0.012)
    emitted = np.ones((len(visible), 3), np.float32)
    np.testing.assert_array_equal(
        bounced_radiance(emitted, np.full((len(visible), 3), 0.9), visible), emitted
    )


def test_face_without_area_sees_no_face():
    vertices, faces = two_squares(1.0, cells=2)
    faces = np.concatenate([faces, [[0, 0, 1]]])
    visible = visible_faces(rays_of(vertices, faces))
    assert (visible[-1] < 0).all() and (visible[:-1] >= 0).any()


def test_radiosity_scales_with_the_photos_for_unknown_irradiance():
    """The same material under half the light: the radiosity of every bounce is halved too."""
    context = replace(lit_ball(), rays=rays_of(*two_squares(0.5)))
    pixels = context.pixels
    dimmed = replace(pixels, irradiance=pixels.irradiance / 2)
    half = replace(context, pixels=dimmed, scale=np.full(1, 2, np.float32)).face_radiosity(0)
    radiosity = context.face_radiosity(0)
    assert radiosity.max() > 0
    np.testing.assert_allclose(half, radiosity / 2, rtol=1e-5)


def test_convex_body_has_no_interreflection():
    ball = trimesh.creation.icosphere(subdivisions=2)
    visible = visible_faces(rays_of(ball.vertices, ball.faces))
    assert (visible < 0).all()
    emitted = np.random.default_rng(0).random((len(visible), 3)).astype(np.float32)
    np.testing.assert_array_equal(
        bounced_radiance(emitted, np.full((len(visible), 3), 0.9), visible), emitted
    )
