"""The light from spheres rendered by Cycles: a wide camera, off its axis, a small sun.

All 20 directions: `run.py bench light`.
"""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

from patina.core.light.sphere import light_from_sphere  # noqa: E402
from patina.core.light.sphere_outline import Circle  # noqa: E402
from tests import make_spheres as made  # noqa: E402

TESTED_DIRECTIONS = (8, 15)  # of the 20 directions


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    made.build()
    folder = tmp_path_factory.mktemp("spheres")
    directions = made.directions()
    return [(directions[i], made.picture(directions[i], folder)) for i in TESTED_DIRECTIONS]


def angle(a, b) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


@pytest.mark.parametrize("which", range(len(made.SPHERES)))
def test_direction_within_half_a_degree(pictures, which):
    """From a circle drawn 4 % too large or small, and from a mask."""
    sphere = made.shown()[which]
    x, y, radius = sphere.circle
    rough = Circle((x + 0.03 * radius, y - 0.02 * radius), 1.04 * radius)
    for direction, pixels in pictures:
        drawn = light_from_sphere(pixels, made.camera(), rough, surface=sphere.surface)
        masked = light_from_sphere(pixels, made.camera(), made.mask(sphere), surface=sphere.surface)
        assert drawn.refined
        assert angle(drawn.direction, direction) < 0.5
        assert angle(masked.direction, direction) < 0.25


def test_sphere_irradiance_is_that_of_sun(pictures):
    """Chrome of reflectance 0.6: 0.6 · 3 away from grazing incidence."""
    _, pixels = pictures[1]
    chrome = [s for s in made.shown() if s.surface == "chrome"]
    for sphere in chrome:
        found = light_from_sphere(pixels, made.camera(), made.mask(sphere))
        assert found.highlights[0].irradiance == pytest.approx(np.full(3, 1.8), rel=0.1)
