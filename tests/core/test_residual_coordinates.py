"""Coordinates against which residuals are plotted, and recovery of known trends along them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.diagnose.selection.residual_trends import coordinates, half_vector_turns, trend
from tests.make_lit_ball import lit_ball

DIAGNOSTIC_COORDINATES = (
    "half angle", "difference angle", "incidence", "view", "photo's centre", "photo", "brightness",
    "curvature", "shadow's edge", "surroundings", "lamp", "position on the object",
    "tangent direction",
)  # fmt: skip


def test_all_diagnostic_coordinates_are_present():
    context = lit_ball()
    names = [c.name for c in coordinates(context)]
    assert len(set(names)) == len(names)
    assert [
        each for each in DIAGNOSTIC_COORDINATES if not any(each in name for name in names)
    ] == []
    assert all(c.values.shape == (len(context.pixels),) for c in coordinates(context))


@pytest.mark.parametrize(("tilt", "expected"), [
    ((1, 0), (0, 90)), ((0, -1), (90, 0)), ((1, 1), (45, 45)), ((-1, 1), (45, 45)),
])  # fmt: skip
def test_tangent_directions_are_those_of_the_half_vector(tilt, expected):
    """A horizontal surface seen from above under a tilted lamp: the half vector is off along x and
    y by known amounts; the scan's z axis is vertical.
    """
    pixels = lit_ball().pixels.select(np.arange(1))
    light = np.array([*tilt, 2.0]) / np.linalg.norm([*tilt, 2.0])
    up = np.array([[0, 0, 1]], np.float32)
    pixels = replace(pixels, normal=up, view=up, light=light[None].astype(np.float32))
    np.testing.assert_allclose(half_vector_turns(pixels)[0, :2], expected, atol=1e-3)
    assert np.isnan(half_vector_turns(pixels)[0, 2])
    below = replace(pixels, light=up)
    assert np.isnan(half_vector_turns(below)).all()


def test_untilted_half_vector_has_no_tangent_component():
    context = lit_ball()
    up = np.broadcast_to(np.float32([0, 0, 1]), context.pixels.normal.shape)
    flat = replace(context, pixels=replace(context.pixels, normal=up))
    (upright,) = [c for c in coordinates(flat) if c.name == "tangent direction, off z"]
    shown = np.ones_like(context.pixels.observed)
    assert not len(trend(upright, 0 * shown, shown, 0.01 * shown, context.pixels.block).at)


def test_known_trend_is_recovered():
    """3 % more light for each half diagonal, in photos with 1 % noise."""
    context = lit_ball(3)
    pixels = context.pixels
    (away,) = [c for c in coordinates(context) if "centre" in c.name]
    shown = pixels.observed / (1 + 0.03 * away.values[:, None])
    found = trend(away, pixels.observed - shown, shown, 0.01 * shown, pixels.block)
    np.testing.assert_allclose(found.mean, 0.03 * found.at, atol=0.002)
    turned = next(c for c in coordinates(context) if c.name == "tangent direction, off z")
    along = trend(turned, 0 * shown, shown, 0.01 * shown, pixels.block)
    assert len(along.at) > 3 and np.abs(along.mean).max() == 0
