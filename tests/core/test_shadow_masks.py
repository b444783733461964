"""Soft shadows against analytic geometry: penumbrae of straight edges, and sources without size."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.geometry import RayScene, SurfaceView, view_surface
from patina.core.geometry.view import cast_shadow
from patina.core.light import DistantLight, MountedLight, NearLight
from patina.core.masks.shadow import (
    TOLERANCE,
    from_grey,
    light_visibility,
    mesh_uncertainty,
    to_grey,
)
from patina.core.scan import Camera, Mesh
from patina.core.scan.camera import Pose
from tests import make_capture as made

HEIGHT = 0.5  # of the roof whose edge is x = 0


def disc_beyond(t):
    """Share of a unit disc on the far side of a chord at signed distance t from its centre."""
    t = np.clip(t, -1.0, 1.0)
    return (np.arccos(-t) + t * np.sqrt(1 - t**2)) / np.pi


def roof() -> RayScene:
    """A floor z = 0 and, over its half x < 0, a roof at HEIGHT with its edge along y."""
    vertices = np.array(
        [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0),
         (-9, -9, HEIGHT), (0, -9, HEIGHT), (0, 9, HEIGHT), (-9, 9, HEIGHT)],
        float,
    )  # fmt: skip
    faces = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], np.int32)
    return RayScene.build(Mesh(vertices, faces))


def camera() -> Camera:
    return Camera("c", 2, 2, "SIMPLE_PINHOLE", (1.0, 1.0, 1.0), Pose(np.eye(3), np.zeros(3)))


def floor_points(x) -> SurfaceView:
    """A view of floor points, as if a photo showed them."""
    n = len(x)
    rng = np.random.default_rng(1)
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    return SurfaceView(
        shape=(1, n),
        seen=np.ones((1, n), bool),
        pixel=np.arange(n, dtype=np.int32),
        face=np.zeros(n, np.int32),
        point=np.stack([x, rng.uniform(-1, 1, n), np.zeros(n)], axis=1),
        normal=up,
        view=up,
        curvature=np.zeros(n, np.float32),
        silhouette=np.zeros((1, n), bool),
    )


def height_above_rays(rays: RayScene) -> float:
    """Height of the roof above the origin of the shadow rays."""
    return HEIGHT - rays.lift


@pytest.mark.parametrize("tilt", [-40.0, 0.0, 30.0, 60.0])
@pytest.mark.parametrize("radius", [0.00465, 0.05, 0.2])
def test_penumbra_of_a_distant_source(tilt: float, radius: float) -> None:
    """The share of the sun's disc on the open side of an edge, along a line across its shadow."""
    rays = roof()
    a = np.radians(tilt)
    sun = DistantLight("sun", np.array([np.sin(a), 0.0, np.cos(a)]), None, radius)
    # angle between the edge and the sun's centre, as a floor point at x sees it
    beyond = np.linspace(-1.6, 1.6, 400) * radius
    x = -height_above_rays(rays) * np.tan(a - beyond)
    seen = light_visibility(rays, floor_points(x), sun, camera(), 256, uncertainty=0.0)
    expected = disc_beyond(beyond / radius)
    assert np.abs(seen - expected).max() < 0.03
    assert np.sqrt(np.mean((seen - expected) ** 2)) < 0.01
    width = np.ptp(x[(seen > 0.02) & (seen < 0.98)])
    true = np.ptp(x[(expected > 0.02) & (expected < 0.98)])
    assert width == pytest.approx(true, rel=0.06)


def test_penumbra_of_a_near_source() -> None:
    rays = roof()
    high, radius = 2.5, 0.1
    lamp = NearLight("lamp", np.array([0.0, 0.0, high]), None, radius)
    x = np.linspace(-0.06, 0.06, 300)
    view = floor_points(x)
    view.point[:, 1] = 0.0
    seen = light_visibility(rays, view, lamp, camera(), 256, uncertainty=0.0)
    # the edge's position in the lamp's plane, from similar triangles
    start = high - height_above_rays(rays) + HEIGHT - high  # height at which shadow rays start
    gap = (high - start) / (HEIGHT - start)
    expected = disc_beyond(-(x - x * gap) / radius)
    assert np.abs(seen - expected).max() < 0.03


def test_lamp_below_roof_is_not_shadowed() -> None:
    rays = roof()
    lamp = NearLight("lamp", np.array([-2.0, 0.0, 0.4]), None, 0.02)
    view = floor_points(np.full(5, -2.0))
    assert (light_visibility(rays, view, lamp, camera(), 32, uncertainty=0.0) == 1).all()


@pytest.mark.parametrize("tilt", [0.0, 35.0])
def test_mesh_uncertainty_blurs_shadow_edge(tilt: float) -> None:
    """For a source without size: a ramp of ± u across the light, the same at every height."""
    rays, u = roof(), 0.03
    a = np.radians(tilt)
    sun = DistantLight("sun", np.array([np.sin(a), 0.0, np.cos(a)]))
    across = np.linspace(-1.5 * u, 1.5 * u, 300)
    x = -height_above_rays(rays) * np.tan(a) + across / np.cos(a)
    seen = light_visibility(rays, floor_points(x), sun, camera(), 256, uncertainty=u)
    assert np.abs(seen - disc_beyond(across / u)).max() < 0.06


def test_horizon_cuts_source() -> None:
    """An open floor under a half-set sun sees half of it."""
    vertices = np.array([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], float)
    rays = RayScene.build(Mesh(vertices, np.array([(0, 1, 2), (0, 2, 3)], np.int32)))
    for above in (-1.2, -0.5, 0.0, 0.4, 1.3):
        a = 0.02 * above
        sun = DistantLight("sun", np.array([np.cos(a), 0.0, np.sin(a)]), None, 0.02)
        view = floor_points(np.linspace(-1, 1, 20))
        seen = light_visibility(rays, view, sun, camera(), 256, uncertainty=0.0)
        assert np.abs(seen - disc_beyond(above)).max() < 0.03


def two_spheres() -> tuple[RayScene, Camera, SurfaceView]:
    """One sphere next to another: curved receiver, curved occluder, seen by a real camera."""
    vertices, faces = made.sphere_mesh(3)
    occluder = 0.4 * (vertices - made.CENTRE) + made.CENTRE + (0.9, -1.1, 0.5)
    both = Mesh(
        np.concatenate([vertices, occluder]),
        np.concatenate([faces, faces + len(vertices)]).astype(np.int32),
    )
    rays = RayScene.build(both)
    rotation, translation = next(iter(made.poses()))
    eye = Camera("c", 90, 70, "SIMPLE_PINHOLE", (130.0, 45.0, 35.0), Pose(rotation, translation))
    return rays, eye, view_surface(rays, eye)


@pytest.mark.parametrize(
    "light",
    [
        DistantLight("a", np.array([0.48, -0.6, 0.64])),
        NearLight("b", made.CENTRE + np.array([3.0, -2.0, 2.0])),
        MountedLight("c", np.array([0.5, -0.2, 0.1])),
    ],
)
def test_source_without_size_gives_hard_shadow(light) -> None:
    rays, eye, view = two_spheres()
    seen = light_visibility(rays, view, light, eye, uncertainty=0.0)
    falls = light.incidence(view.point, eye)
    lit = np.einsum("ij,ij->i", view.normal, falls.towards) > 0
    lit &= ~cast_shadow(rays, view.point, view.normal, falls.towards, falls.distance)
    assert np.array_equal(seen, lit.astype(np.float32))
    assert 0.1 < lit.mean() < 0.999


def test_few_rays_agree_with_many_rays() -> None:
    """Pixels that twelve rays call fully lit or dark have no significant penumbra."""
    rays, eye, view = two_spheres()
    sun = DistantLight("sun", np.array([0.48, -0.6, 0.64]), None, 0.08)
    quick = light_visibility(rays, view, sun, eye, uncertainty=0.02)
    many = light_visibility(rays, view, sun, eye, 2048, uncertainty=0.02)
    assert np.abs(quick - many).max() < 0.12
    assert np.abs(quick - many).mean() < 0.006
    soft = (many > 0.03) & (many < 0.97)
    assert soft.sum() > 50
    assert abs(quick[soft].mean() - many[soft].mean()) < 0.01


def test_default_uncertainty_follows_mesh_size_and_resolution() -> None:
    vertices, faces = made.sphere_mesh(3)
    coarse = Mesh(*made.sphere_mesh(2))
    fine = Mesh(vertices, faces)
    assert mesh_uncertainty(coarse) == pytest.approx(2 * mesh_uncertainty(fine), rel=0.05)
    grown = Mesh(7 * vertices, faces)
    assert mesh_uncertainty(grown) == pytest.approx(7 * mesh_uncertainty(fine))


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
@settings(max_examples=200, deadline=None)
def test_grey_values_are_monotone_and_keep_threshold(one: float, two: float) -> None:
    """Above one half exactly where more than the tolerance is shadowed; darker means more light."""
    a, b = to_grey(np.array([one, two]))
    assert (a > 127.5) == (1 - one > TOLERANCE + 1e-6)
    if one <= two:
        assert a >= b
    assert abs(from_grey(np.array([a], np.uint8))[0] - one) < 0.005


def test_extreme_grey_values() -> None:
    assert to_grey(np.array([1.0, 0.0])).tolist() == [0, 255]
    assert to_grey(np.float32(1 - TOLERANCE)) == 127
