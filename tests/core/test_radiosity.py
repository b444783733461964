"""Light that goes to and fro between the faces of a mesh, against what is known exactly."""

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
    """Unit squares that face each other, the lower one first."""
    line = np.linspace(0, 1, cells + 1)
    x, y = np.meshgrid(line, line, indexing="ij")
    at = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:])
    up = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    low = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    return (
        np.concatenate([low, low + np.array([0, 0, apart])]),
        np.concatenate([up, up[:, ::-1] + len(low)]),
    )


@pytest.mark.parametrize(("apart", "factor"), [(1.0, 0.1998), (0.5, 0.4153), (2.0, 0.0686)])
def test_two_squares_see_as_much_of_each_other_as_is_known(apart, factor):
    """View factors of unit squares (Howell, A Catalog of Radiation Configuration Factors, C-11)."""
    vertices, faces = two_squares(apart)
    seen = visible_faces(rays_of(vertices, faces))
    half = len(faces) // 2
    np.testing.assert_allclose((seen[:half] >= half).mean(), factor, atol=0.012)
    np.testing.assert_allclose(
        ((seen[half:] >= 0) & (seen[half:] < half)).mean(), factor, atol=0.012
    )


@pytest.mark.parametrize("albedo", [0.2, 0.6, 0.95])
def test_in_a_closed_room_light_adds_up_to_a_geometric_series(albedo):
    """All faces of a hollow ball see one another alike: Σ albedoᵏ of what they send off."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    seen = visible_faces(rays_of(ball.vertices, ball.faces[:, ::-1]))
    assert (seen >= 0).all()
    sent = np.tile(np.float32([1.0, 0.5, 0.1]), (len(seen), 1))
    found = bounced_radiance(sent, np.full((len(seen), 3), albedo, np.float32), seen)
    expected = sent * (1 - albedo**BOUNCES) / (1 - albedo)
    np.testing.assert_allclose(found, expected, rtol=1e-4)


def test_the_inside_of_a_scan_sends_off_nothing():
    """Through a hole one looks at faces from behind: the upper square turned over."""
    vertices, faces = two_squares(1.0)
    half = len(faces) // 2
    faces[half:] = faces[half:, ::-1]
    seen = visible_faces(rays_of(vertices, faces))
    assert (seen < 0).all()
    np.testing.assert_allclose((seen[:half] == BEHIND).mean(), 0.1998, atol=0.012)
    sent = np.ones((len(seen), 3), np.float32)
    np.testing.assert_array_equal(bounced_radiance(sent, np.full((len(seen), 3), 0.9), seen), sent)


def test_a_face_without_area_sees_nothing():
    vertices, faces = two_squares(1.0, cells=2)
    faces = np.concatenate([faces, [[0, 0, 1]]])
    seen = visible_faces(rays_of(vertices, faces))
    assert (seen[-1] < 0).all() and (seen[:-1] >= 0).any()


def test_where_irradiance_is_not_known_bounces_are_as_bright_as_the_photos():
    """Photos half as bright, of the same material under half the light: so is what faces send off,
    of every bounce."""
    context = replace(lit_ball(), rays=rays_of(*two_squares(0.5)))
    pixels = context.pixels
    dim = replace(pixels, irradiance=pixels.irradiance / 2)
    half = replace(context, pixels=dim, scale=np.full(1, 2, np.float32)).face_radiosity(0)
    whole = context.face_radiosity(0)
    assert whole.max() > 0
    np.testing.assert_allclose(half, whole / 2, rtol=1e-5)


def test_what_sees_nothing_sends_off_what_the_lamp_gives():
    ball = trimesh.creation.icosphere(subdivisions=2)
    seen = visible_faces(rays_of(ball.vertices, ball.faces))
    assert (seen < 0).all()
    sent = np.random.default_rng(0).random((len(seen), 3)).astype(np.float32)
    np.testing.assert_array_equal(bounced_radiance(sent, np.full((len(seen), 3), 0.9), seen), sent)
