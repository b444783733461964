"""Partly lit pixels at shadow edges, and shadows that follow a corrected lamp, against plain
geometry.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
import trimesh

from patina.core.diagnose.effects.area_light import RADII, AreaLight
from patina.core.diagnose.effects.base.displaced_shadows import DisplacedShadows
from patina.core.diagnose.effects.light_direction import LightDirection
from patina.core.diagnose.forward.partial_visibility import (
    SIDE,
    partial_visibility,
    pixel_part_points,
)
from patina.core.diagnose.forward.pixels import Pixels
from patina.core.diagnose.forward.shading_state import ShadingState
from patina.core.geometry import RayScene
from patina.core.geometry.lift import MIN_LIFT, SHADOW_LIFT, facet_lift
from patina.core.scan import Mesh
from tests import make_lit_ball

WALL_HEIGHT = 0.5  # height; the wall stands at x = 0 across a floor
PIXEL_WIDTH = 0.02  # width of a pixel on the floor


def _floor_and_wall() -> RayScene:
    floor = [[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]
    wall = [[0, -2, 0], [0, 2, 0], [0, 2, WALL_HEIGHT], [0, -2, WALL_HEIGHT]]
    faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    mesh = Mesh(np.array(floor + wall, float), np.array(faces, np.int32))
    return RayScene.build(mesh).close()


def _row_of_pixels(x: np.ndarray, light: np.ndarray) -> Pixels:
    n = len(x)
    some = make_lit_ball.lit_ball().pixels.select(np.zeros(n, np.intp))
    ones = np.ones((n, 1), np.float32)
    step = np.zeros((n, 2, 3), np.float32)
    step[:, 0, 0] = step[:, 1, 1] = PIXEL_WIDTH
    point = np.stack([x, np.full(n, 0.1), np.zeros(n)], axis=1)
    return replace(
        some, point=point, normal=ones * np.float32([0, 0, 1]), light=ones * light, step=step,
        turn=np.zeros((n, 2, 3), np.float32), visible=np.ones(n, np.float32),
    )  # fmt: skip


def _towards(elevation: float) -> np.ndarray:
    return np.array([-np.cos(elevation), 0, np.sin(elevation)], np.float32)


@pytest.mark.parametrize("elevation", [0.2, 0.5, 1.0])
def test_visibility_is_unshadowed_fraction_of_pixel(elevation: float) -> None:
    ends = WALL_HEIGHT / np.tan(elevation)  # of the shadow
    x = ends + PIXEL_WIDTH * np.linspace(-2, 2, 41)
    towards = _towards(elevation)
    pixels = _row_of_pixels(x, towards)
    found = partial_visibility(_floor_and_wall(), pixels, pixels.light)
    true = np.clip((x - ends) / PIXEL_WIDTH + 0.5, 0, 1)
    # columns of rays, and the ray offset by which a shadow begins late
    late = SHADOW_LIFT * 4 / np.tan(elevation) / PIXEL_WIDTH
    assert np.abs(found - true).max() <= 0.5 / SIDE + late + 1e-6
    assert abs(found.mean() - true.mean()) < 0.02 + late


def test_back_facing_surface_is_not_cast_shadow() -> None:
    pixels = _row_of_pixels(np.array([0.1]), _towards(0.5))
    assert partial_visibility(_floor_and_wall(), pixels, -pixels.light) == pytest.approx(1.0)


def test_wide_lamp_gives_penumbra_over_whole_pixels() -> None:
    """Compared with the shadow of a wall under a disc of lamps, seen by square pixels; a very small
    lamp equals a point.
    """
    high, rng = 0.5, np.random.default_rng(0)
    ends = WALL_HEIGHT / np.tan(high)
    wide = 5 * PIXEL_WIDTH  # than which the penumbra is narrower
    x = ends + np.linspace(-0.15, 0.15, 61)
    rays = _floor_and_wall()
    pixels = _row_of_pixels(x, _towards(high))
    pixels = replace(pixels, step=pixels.step * np.float32(wide / PIXEL_WIDTH))
    pixels = replace(pixels, visible=partial_visibility(rays, pixels, pixels.light))
    effect = AreaLight.of(replace(make_lit_ball.lit_ball(), pixels=pixels, rays=rays))
    assert effect is not None and np.array_equal(effect.free[:, 0], pixels.visible)
    out, turn = np.sqrt(rng.random(4000)), 2 * np.pi * rng.random(4000)
    for place in (1, 2):  # lamps of 1 and of 2 degrees
        aside = np.tan(RADII[place]) * out
        sides = (
            aside * np.cos(turn) * effect.first[:1].T + aside * np.sin(turn) * effect.other[:1].T
        )
        lamps = _towards(high)[:, None] + sides
        reach = -WALL_HEIGHT * lamps[0] / lamps[2]
        true = np.clip((x[:, None] - reach) / wide + 0.5, 0, 1).mean(axis=1)
        assert np.abs(effect.free[:, place] - true).max() < 0.5 / SIDE  # columns of rays
        assert abs(effect.free[:, place].mean() - true.mean()) < 0.02


def test_shadow_follows_corrected_lamp() -> None:
    """A lamp corrected downwards casts a longer shadow; the correction changes nothing where the
    lamp is where the capture states.
    """
    low, high = 0.45, 0.5
    x = np.linspace(0.7, 1.3, 61)
    rays = _floor_and_wall()
    pixels = _row_of_pixels(x, _towards(high))
    pixels = replace(pixels, visible=partial_visibility(rays, pixels, pixels.light))
    context = replace(make_lit_ball.lit_ball(), pixels=pixels, rays=rays)
    effect = LightDirection.of(context)
    assert effect is not None
    moved = _towards(low) / (_towards(low) @ _towards(high)) - _towards(high)
    angles = np.array([effect.aside[0] @ moved, effect.other[0] @ moved])
    cast = effect.with_rays(context, angles).shading(ShadingState.of(pixels), angles)
    true = partial_visibility(rays, pixels, np.broadcast_to(_towards(low), (len(x), 3)))
    assert np.abs(cast.visible - true).max() < 1e-5
    assert (cast.visible < 0.5).sum() > (pixels.visible < 0.5).sum() + 3
    still = DisplacedShadows.of(context, effect, np.zeros(2))
    assert np.abs(still.more).max() == 0
    one_ray = replace(pixels, visible=np.round(pixels.visible))  # as away from any edge
    still = DisplacedShadows.of(replace(context, pixels=one_ray), effect, np.zeros(2))
    assert np.abs(still.more).max() == 0


def test_ray_offset_follows_mesh_resolution() -> None:
    """On a sphere it is about the height of the cap over a facet, between the float32 minimum and
    the upper limit that suffices for every scan.
    """
    lifts = []
    for level in (1, 5, 6):
        ball = trimesh.creation.icosphere(subdivisions=level)
        mesh = Mesh(np.array(ball.vertices), np.array(ball.faces, np.int32))
        lift = facet_lift(mesh) / mesh.size
        assert MIN_LIFT <= lift <= SHADOW_LIFT
        lifts.append(lift)
    assert lifts[0] == SHADOW_LIFT and lifts[0] > lifts[1] > lifts[2]


def test_pixel_selection_keeps_every_column() -> None:
    """A new column of Pixels is kept by every selection."""
    pixels = make_lit_ball.lit_ball().pixels
    some = pixels.select(slice(3, 7))
    assert all(len(getattr(some, f.name)) == 4 for f in fields(Pixels))


def test_concave_surface_facing_lamp_is_lit() -> None:
    """The plane at a pixel's centre lies below the mesh all around it; the mesh itself is lit."""
    side = np.linspace(-0.4, 0.4, 81)
    x, y = (v.ravel() for v in np.meshgrid(side, side))
    number = np.arange(len(x)).reshape(len(side), -1)
    a, b, c, d = (
        v.ravel() for v in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    )
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    rays = RayScene.build(Mesh(np.stack([x, y, x**2 + y**2], axis=1), faces)).close()
    middle = np.random.default_rng(3).uniform(-0.05, 0.05, (50, 2))
    up = np.float32([0, 0, 1])
    pixels = _row_of_pixels(middle[:, 0], up)
    normal = np.concatenate([-2 * middle, np.ones((50, 1))], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    point = np.concatenate([middle, np.sum(middle**2, axis=1, keepdims=True)], axis=1)
    pixels = replace(
        pixels, point=point, normal=normal.astype(np.float32), view=np.tile(up, (50, 1))
    )
    assert partial_visibility(rays, pixels, pixels.light) == pytest.approx(1.0)
    # and parts of a pixel lie on the mesh
    parts = pixel_part_points(rays, pixels)
    assert parts[..., 2] == pytest.approx(np.sum(parts[..., :2] ** 2, axis=-1), abs=1e-4)
