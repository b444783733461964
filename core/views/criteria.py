"""The criteria that decide whether a pixel is sampled: a label, a colour and advice for each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..samples import Criterion


@dataclass(frozen=True)
class Look:
    """How a criterion is shown. key: for files and properties; word: the label, as in "39 %
    clipped"; colour: sRGB, 0..255; advice: the meaning, and what to do."""

    key: str
    word: str
    colour: tuple[int, int, int]
    advice: str


# Only "reliable" is blue-green; the criteria that exclude pixels are warm, purple or grey. The
# colours were optimised for the largest smallest difference of any two, also for viewers without
# red or green cones.
LOOKS: dict[Criterion, Look] = {
    Criterion.NO_SURFACE: Look(
        "no_surface", "no surface", (58, 60, 64),
        "There is no mesh behind these pixels. If the photo shows the object here, the mesh or the "
        "camera pose is wrong, or the scan has a hole.",
    ),
    Criterion.NO_MATERIAL: Look(
        "no_material", "no material", (172, 172, 172),
        "No mask and no face assigns a material. To measure it, paint it or assign it in a mask.",
    ),
    Criterion.SHADOW_MASK: Look(
        "shadow_mask", "painted as shadow", (44, 0, 140),
        "A shadow mask excludes these pixels. Erase the mask where the lamp reaches the surface.",
    ),
    Criterion.HIGHLIGHT_MASK: Look(
        "highlight_mask", "painted as highlight to exclude", (160, 30, 200),
        "A highlight mask excludes these pixels. Keep the highlights of the lamp itself: the gloss "
        "is measured from them.",
    ),
    Criterion.IGNORE_MASK: Look(
        "ignore_mask", "painted as ignored", (207, 120, 255),
        "An ignore mask excludes these pixels.",
    ),
    Criterion.TURNED_AWAY: Look(
        "turned_away", "in shadow: turned away", (56, 53, 50),
        "The surface faces away from the lamp. Use lamps on other sides to reach it. If the photo "
        "is bright here, the direction of the light is wrong.",
    ),
    Criterion.CAST_SHADOW: Look(
        "cast_shadow", "in shadow: cast", (112, 106, 104),
        "Another part of the mesh blocks the lamp. If the photo is bright here, the direction of "
        "the light is wrong, or the mesh has extra geometry.",
    ),
    Criterion.SHADOW_EDGE: Look(
        "shadow_edge", "near a shadow's edge", (255, 184, 0),
        "An error of one pixel would move these pixels to the other side of the shadow's edge. The "
        "distance is set by shadow_margin. A large lamp casts soft edges: make shadow masks.",
    ),
    Criterion.OUTLINE: Look(
        "outline", "near an outline", (255, 243, 51),
        "An error of one pixel would move these pixels to another surface. The distance is set by "
        "silhouette_margin.",
    ),
    Criterion.GRAZING: Look(
        "grazing", "grazing", (196, 10, 55),
        "The view or the light is so grazing that a small error of the mesh changes the result "
        "much. Take photos from the front, with lamps near the camera. The limit is set by "
        "smallest_cosine.",
    ),
    Criterion.MASK_BORDER: Look(
        "mask_border", "at a mask's border", (255, 134, 95),
        "These pixels may show both materials. The distance is set by mask_margin.",
    ),
    Criterion.UNUSABLE: Look(
        "unusable", "clipped", (210, 104, 15),
        "The pixels are overexposed (in a bracket: in all exposures), so their radiance is "
        "unknown. Expose less, or take a bracket.",
    ),
    Criterion.OUTSIDE_BEAM: Look(
        "outside_beam", "outside the light's beam", (76, 93, 0),
        "The beam of the lamp gives almost no light here. Turn the lamp, or use a wider one.",
    ),
    Criterion.CURVED: Look(
        "curved", "too curved", (255, 249, 215),
        "The curvature is above the threshold of the paper's method, curvature in [fit]. The "
        "measured method uses such pixels.",
    ),
    Criterion.RELIABLE: Look(
        "reliable", "reliable", (0, 147, 155),
        "These pixels are samples: the material is measured from them.",
    ),
}  # fmt: skip

PALETTE: NDArray[np.uint8] = np.array([LOOKS[c].colour for c in Criterion], np.uint8)
"""(criteria, 3) sRGB of each criterion, indexed by its number."""
UNSELECTED = (121, 226, 225)
"""sRGB of reliable pixels that are not in the random subset of the samples that a fit uses."""
