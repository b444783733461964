"""Brush strokes are recognised by their colour, over any image and with soft brushes."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from patina.core.masks.strokes import overlaid, strokes

PALETTE = np.array(
    [[230, 159, 0], [86, 180, 233], [0, 158, 115], [240, 228, 66], [91, 42, 134], [0, 0, 0]],
    np.uint8,
)


@given(st.integers(0, 2**32 - 1), st.floats(0.7, 1.0))
def test_stroke_is_recognised_by_its_colour(seed: int, strength: float) -> None:
    rng = np.random.default_rng(seed)
    picture = rng.integers(0, 200, (12, 16, 3)).astype(np.uint8)
    worn = rng.integers(-1, len(PALETTE), (12, 16))
    far = np.abs(picture.astype(int) - PALETTE[worn]).sum(axis=2) > 120
    painted = overlaid(picture, worn, PALETTE, strength)
    found = strokes(picture, painted, PALETTE)
    assert (found[worn < 0] == -1).all()
    recognised = (worn >= 0) & far
    # two colours may lie on one line in colour space
    assert (found[recognised] == worn[recognised]).mean() > 0.9
    solid = strokes(picture, overlaid(picture, worn, PALETTE, 1.0), PALETTE)
    changed = (worn >= 0) & (np.abs(picture.astype(int) - PALETTE[worn]).max(axis=2) >= 2)
    assert (solid[changed] == worn[changed]).all()


def test_rim_of_soft_brush_is_not_paint() -> None:
    picture = np.full((1, 10, 3), 120, np.uint8)
    share = np.linspace(0.05, 0.95, 10)[None, :, None]
    after = np.round((1 - share) * picture + share * PALETTE[1]).astype(np.uint8)
    assert (strokes(picture, after, PALETTE)[0] == [-1] * 5 + [1] * 5).all()


def test_unpainted_image_has_no_strokes() -> None:
    picture = np.random.default_rng(0).integers(0, 255, (20, 20, 3)).astype(np.uint8)
    assert (strokes(picture, picture, PALETTE) == -1).all()
