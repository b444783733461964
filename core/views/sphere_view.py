"""A large lit sphere, on request with that of another BRDF and their difference."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import display
from .drawing import INK, Drawing, Label, Part, Picture, rgb
from .raster import PAPER
from .sphere import lit_sphere
from .subject import Subject

SPHERE_WIDTH, TOP, GAP, PIXELS = 200.0, 20.0, 14.0, 400
FULL_COLOUR = 0.30  # difference shown in full colour, relative to white


def sphere_view(subject: Subject, other: Subject | None = None, exposure: float = 0.0) -> Drawing:
    """Draw the sphere under a key light of irradiance π and a rim light; exposure: in stops."""
    gain = 2.0**exposure
    mine, coverage = lit_sphere(subject.evaluate, PIXELS)
    shown = [(subject.label, display.srgb(mine * gain))]
    if other is not None:
        its, _ = lit_sphere(other.evaluate, PIXELS)
        difference = display.difference_picture(its * gain, mine * gain, FULL_COLOUR)
        shown += [(other.label, display.srgb(its * gain)), ("difference", difference)]
    parts: list[Part] = []
    for place, (label, pixels) in enumerate(shown):
        left = GAP + place * (SPHERE_WIDTH + GAP)
        parts.append(Label(left + SPHERE_WIDTH / 2, TOP - 7, label, "middle", INK))
        parts.append(Picture(left, TOP, SPHERE_WIDTH, SPHERE_WIDTH, _on_paper(pixels, coverage)))
    caption = f"exposure {exposure:+.1f} stops"
    if other is not None:
        caption += (
            f" · difference: blue darker, red brighter, full at {100 * FULL_COLOUR:.0f} % of white"
        )
    parts.append(Label(GAP, TOP + SPHERE_WIDTH + 16, caption))
    width = GAP + len(shown) * (SPHERE_WIDTH + GAP)
    return Drawing(width, TOP + SPHERE_WIDTH + 26, "lit sphere", tuple(parts))


def _on_paper(pixels: NDArray[np.uint8], coverage: NDArray[np.floating]) -> NDArray[np.uint8]:
    paper = rgb(PAPER).astype(np.float32)
    return (paper + coverage[..., None] * (pixels - paper) + 0.5).astype(np.uint8)
