"""Camera pose correction: normals and visibility of the surface that a displaced pixel shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import trimesh

from patina.core.diagnose.effects.camera_pose import CameraPose
from patina.core.diagnose.forward.shading_state import ShadingState
from patina.core.diagnose.solver.model import Model
from patina.core.geometry import RayScene
from patina.core.geometry.view import cast_shadow
from patina.core.scan import Mesh
from tests.make_lit_ball import changed, lit_ball

RADIUS = 0.4  # radius of the ball
PIXEL = 0.01  # pixel size in scan units


def test_ball_normals_are_those_at_displaced_pixel():
    """Far from the original pixel a linear extrapolation leaves the ball; traced rays do not."""
    context, truth = _ball_context()
    effect = CameraPose.of(context)
    x = np.tile([6.0, 0.0, 0.0], len(effect.photos))
    straight = effect.shading(ShadingState.of(context.pixels), x).normal
    seen = effect.with_rays(context, x)
    known = seen.seen.known
    assert known.mean() > 0.9
    found = seen.shading(ShadingState.of(context.pixels), x).normal
    errors = [np.linalg.norm(n - truth, axis=1)[known] for n in (straight, found)]
    assert np.median(errors[1]) < 0.2 * np.median(errors[0])
    assert np.percentile(errors[1], 95) < 0.01


def test_derivatives_with_rays_match_linear_model():
    context, _ = _ball_context()
    effect = CameraPose.of(context)
    x = np.tile([3.0, 1.0, 0.5], len(effect.photos))
    seen = effect.with_rays(context, x)
    step = np.tile([0.01, 0.0, 0.0], len(effect.photos))
    now = ShadingState.of(context.pixels)
    one, other = (
        e.shading(now, x + step).normal - e.shading(now, x).normal for e in (effect, seen)
    )
    unchanged = ~seen.seen.ends  # elsewhere the visibility changes
    assert unchanged.mean() > 0.8
    np.testing.assert_allclose(other[unchanged], one[unchanged], atol=3e-5)
    assert not other[seen.seen.ends & seen.seen.known].any()


def test_large_camera_offset_is_found_by_ray_search():
    """Derivatives carry no information about a shadow displaced by five pixels; a search with
    traced rays does.
    """
    context, _ = _ball_context(boxes=True)
    effect = CameraPose.of(context)
    x = np.zeros(3 * len(effect.photos))
    x[3] = 5.0
    model = Model(context.pixels, context.brdfs)

    def shown(effect, x):
        return replace(model, effects=(effect,), x=(x,)).predicted()

    context = changed(context, shown(effect.with_rays(context, x), x))
    found = effect.ray_parameters(context, np.zeros(len(x)), shown)
    np.testing.assert_allclose(found[0::3], x[0::3], atol=0.3)


def test_shadows_are_those_at_displaced_pixel():
    """Boxes stand between the lamps and the ball; six pixels away their shadows fall elsewhere."""
    context, truth = _ball_context(boxes=True)
    pixels = context.pixels
    lit, uncorrected = (
        (~cast_shadow(context.rays, RADIUS * normal, normal, pixels.light, None)).astype(np.float32)
        for normal in (truth, pixels.normal.astype(float))
    )
    pixels = replace(pixels, visible=uncorrected)
    context = replace(context, pixels=pixels)
    effect = CameraPose.of(context)
    x = np.tile([6.0, 0.0, 0.0], len(effect.photos))
    seen = effect.with_rays(context, x)
    found = seen.shading(ShadingState.of(pixels), x).visible
    facing = np.einsum("ij,ij->i", truth, pixels.light) > 0.05
    errors = [np.abs(v - lit)[facing].mean() for v in (uncorrected, found)]
    assert errors[0] > 0.015
    assert errors[1] < 0.1 * errors[0]


def _ball_context(boxes: bool = False):
    """(The lit ball with a mesh, (n, 3) normals six pixels to the right of each pixel.) boxes:
    occluders on the three axes, next to the ball.
    """
    context = lit_ball(3)
    ball = trimesh.creation.icosphere(subdivisions=5, radius=RADIUS)
    if boxes:
        ball += trimesh.util.concatenate(
            [trimesh.creation.box(bounds=[at - 0.1, at + 0.1]) for at in 2 * RADIUS * np.eye(3)]
        )
    rays = RayScene.build(Mesh(np.asarray(ball.vertices), np.asarray(ball.faces, np.int32)))
    pixels = context.pixels
    view = pixels.view.astype(float)
    right = np.cross([0.0, 0.0, 1.0], view)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    inner = np.einsum("ij,ij->i", pixels.normal, view) > 0.6
    rows = np.flatnonzero(inner)
    pixels, view, right = pixels.select(rows), view[rows], right[rows]
    along = right - np.einsum("ij,ij->i", right, pixels.normal)[:, None] / np.einsum(
        "ij,ij->i", view, pixels.normal
    )[:, None] * view  # fmt: skip
    step = np.zeros((len(rows), 2, 3), np.float32)
    step[:, 0] = PIXEL * along
    turn = np.zeros_like(step)
    turn[:, 0] = PIXEL * along / RADIUS
    pixels = replace(pixels, step=step, turn=turn)
    flat = RADIUS * pixels.normal + 6 * PIXEL * right
    across = flat - np.einsum("ij,ij->i", flat, view)[:, None] * view
    height = np.sqrt(RADIUS**2 - np.sum(across**2, axis=1))
    truth = (across + height[:, None] * view) / RADIUS
    return replace(context, pixels=pixels, rays=rays), truth
