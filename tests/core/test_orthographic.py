"""Orthographic cameras, and cameras of scaled photos."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patina.core.errors import PatinaError
from patina.core.geometry import RayScene, view_surface
from patina.core.scan import Camera, Mesh, Pose, Similarity
from tests import make_capture as made


def camera(width: int = 90, height: int = 70, scale: float = 25.0) -> Camera:
    rotation, _ = made.look_at(np.array([4.0, -3.0, 2.0]), made.CENTRE)
    return Camera(
        "o", width, height, "ORTHOGRAPHIC", (scale, scale, width / 2, height / 2),
        Pose(rotation, -rotation @ made.CENTRE),
    )  # fmt: skip


@given(st.integers(0, 1000))
def test_rays_pass_through_projected_points(seed: int) -> None:
    one = camera()
    points = made.CENTRE + np.random.default_rng(seed).normal(size=(20, 3)) * 0.3
    pixels = one.project(points)
    front = np.isfinite(pixels[:, 0])
    starts, directions = one.ray_starts(pixels[front]), one.rays(pixels[front])
    away = points[front] - starts
    along = np.einsum("ij,ij->i", away, directions)
    assert np.abs(away - along[:, None] * directions).max() < 1e-9


def test_orthographic_sphere_outline_and_normals() -> None:
    """The outline of a sphere of radius 1 has the radius of the camera's scale, and the normal at
    (x, y) is (x, y, √(1 − x² − y²)) in the camera's axes.
    """
    vertices, faces = made.sphere_mesh(6)
    rays = RayScene.build(Mesh(vertices, faces.astype(np.int32)))
    one = camera()
    view = view_surface(rays, one)
    assert view.seen.sum() == pytest.approx(np.pi * 25.0**2, rel=0.01)
    rows, columns = np.unravel_index(view.pixel, view.shape)
    x, y = (columns + 0.5 - 45) / 25, (rows + 0.5 - 35) / 25
    inside = x**2 + y**2 < 0.9
    normal = view.normal[inside] @ one.pose.rotation.T
    expected = np.stack([x, y, -np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=1)[inside]
    assert np.abs(normal - expected).max() < 0.01
    assert np.allclose(view.view, -one.pose.rotation[2])


def test_similarity_transforms_cameras_with_points() -> None:
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    move = Similarity(turn, rng.normal(size=3) * 10, 2.5)
    points = made.CENTRE + rng.normal(size=(30, 3)) * 0.3
    rotation, translation = next(iter(made.poses(4)))
    lens = (200.0, 60.0, 45.0)
    pinhole = Camera("p", 120, 90, "SIMPLE_PINHOLE", lens, Pose(rotation, translation))
    for one in (camera(), pinhole):
        before, after = one.project(points), move.camera(one).project(move.points(points))
        assert np.allclose(before, after, atol=1e-9, equal_nan=True)


def test_scaled_photo_scales_its_camera() -> None:
    rotation, translation = next(iter(made.poses(4)))
    parameters = (2000.0, 1990.0, 1210.0, 890.0, 0.05, -0.02, 1e-3, -2e-3)
    whole = Camera("p", 2400, 1800, "OPENCV", parameters, Pose(rotation, translation))
    points = made.CENTRE + np.random.default_rng(4).normal(size=(50, 3)) * 0.3
    quarter = whole.resized(600, 450)
    assert np.allclose(quarter.project(points), whole.project(points) / 4, atol=1e-9)
    assert whole.resized(601, 451).width == 601  # both sides rounded up: still a scaled copy
    for size in ((450, 600), (601, 400), (2399, 1800), (2390, 1793)):
        with pytest.raises(PatinaError, match="expected a scaled copy"):
            whole.resized(*size)
