"""What a photo shows that lies beside where the scan says: the surface's own normal there."""

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

RADIUS = 0.4  # of the ball
PIXEL = 0.01  # scan units


def test_normals_of_a_ball_are_those_of_the_place_that_is_shown():
    """Far beside where a pixel should look a straight line leaves the ball; rays do not."""
    context, truth = _on_a_real_ball()
    effect = CameraPose.of(context)
    x = np.tile([6.0, 0.0, 0.0], len(effect.photos))
    straight = effect.shading(ShadingState.of(context.pixels), x).normal
    seen = effect.with_rays(context, x)
    known = seen.seen.known
    assert known.mean() > 0.9
    found = seen.shading(ShadingState.of(context.pixels), x).normal
    missed = [np.linalg.norm(n - truth, axis=1)[known] for n in (straight, found)]
    assert np.median(missed[1]) < 0.2 * np.median(missed[0])
    assert np.percentile(missed[1], 95) < 0.01


def test_about_where_it_was_looked_for_it_turns_as_before():
    context, _ = _on_a_real_ball()
    effect = CameraPose.of(context)
    x = np.tile([3.0, 1.0, 0.5], len(effect.photos))
    seen = effect.with_rays(context, x)
    step = np.tile([0.01, 0.0, 0.0], len(effect.photos))
    now = ShadingState.of(context.pixels)
    one, other = (
        e.shading(now, x + step).normal - e.shading(now, x).normal for e in (effect, seen)
    )
    calm = ~seen.seen.ends  # elsewhere it is the light that changes
    assert calm.mean() > 0.8
    np.testing.assert_allclose(other[calm], one[calm], atol=3e-5)
    assert not other[seen.seen.ends & seen.seen.known].any()


def test_a_photo_far_beside_is_found_by_trial():
    """Slopes say nothing of a shadow that has moved by five pixels; rays that are tried do."""
    context, _ = _on_a_real_ball(boxes=True)
    effect = CameraPose.of(context)
    x = np.zeros(3 * len(effect.photos))
    x[3] = 5.0
    model = Model(context.pixels, context.brdfs)

    def shown(effect, x):
        return replace(model, effects=(effect,), x=(x,)).predicted()

    context = changed(context, shown(effect.with_rays(context, x), x))
    found = effect.ray_parameters(context, np.zeros(len(x)), shown)
    np.testing.assert_allclose(found[0::3], x[0::3], atol=0.3)


def test_shadows_are_those_of_the_place_that_is_shown():
    """Boxes stand between lamps and ball; six pixels beside, their shadows lie otherwise."""
    context, truth = _on_a_real_ball(boxes=True)
    pixels = context.pixels
    lit, told = (
        (~cast_shadow(context.rays, RADIUS * normal, normal, pixels.light, None)).astype(np.float32)
        for normal in (truth, pixels.normal.astype(float))
    )
    pixels = replace(pixels, visible=told)
    context = replace(context, pixels=pixels)
    effect = CameraPose.of(context)
    x = np.tile([6.0, 0.0, 0.0], len(effect.photos))
    seen = effect.with_rays(context, x)
    found = seen.shading(ShadingState.of(pixels), x).visible
    facing = np.einsum("ij,ij->i", truth, pixels.light) > 0.05
    missed = [np.abs(v - lit)[facing].mean() for v in (told, found)]
    assert missed[0] > 0.015
    assert missed[1] < 0.1 * missed[0]


def _on_a_real_ball(boxes: bool = False):
    """(The lit ball with a mesh, (n, 3) normals six pixels to the right of each pixel.) boxes: on
    the three axes, beside it."""
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
