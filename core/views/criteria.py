"""The criteria that decide about pixels, as a person meets them: a word, a colour, what to do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..samples import Criterion


@dataclass(frozen=True)
class Look:
    """key: for files and properties; word: "39 % …"; colour: sRGB, 0..255; advice: what it means
    and what can be done."""

    key: str
    word: str
    colour: tuple[int, int, int]
    advice: str


# Reliable is blue-green, the only one; what was rejected is warm, purple or grey. Searched for the
# largest differences between any two, also for eyes without red or green cones.
LOOKS: dict[Criterion, Look] = {
    Criterion.NO_SURFACE: Look(
        "no_surface", "no surface", (58, 60, 64),
        "Nothing of the mesh is here. Where the photo shows the object, the mesh or the camera's "
        "pose is off, or the scan has a hole.",
    ),
    Criterion.NO_MATERIAL: Look(
        "no_material", "no material", (172, 172, 172),
        "No mask and no face says what it is made of. Paint it, or name it in a mask, if it should "
        "be measured.",
    ),
    Criterion.SHADOW_MASK: Look(
        "shadow_mask", "painted as shadow", (44, 0, 140),
        "A shadow mask leaves it out. Erase it there if the lamp does reach it.",
    ),
    Criterion.HIGHLIGHT_MASK: Look(
        "highlight_mask", "painted as highlight to leave out", (160, 30, 200),
        "A highlight mask leaves it out. Leave the lamp's own highlights in: they tell gloss.",
    ),
    Criterion.IGNORE_MASK: Look(
        "ignore_mask", "painted as ignored", (207, 120, 255),
        "An ignore mask leaves it out.",
    ),
    Criterion.TURNED_AWAY: Look(
        "turned_away", "in shadow: turned away", (56, 53, 50),
        "The surface faces away from the lamp. Lamps on other sides reach it; where the photo is "
        "bright here, the light's direction is wrong.",
    ),
    Criterion.CAST_SHADOW: Look(
        "cast_shadow", "in shadow: cast", (112, 106, 104),
        "Another part of the mesh blocks the lamp. Where the photo is bright here, the light's "
        "direction is wrong or the mesh has too much.",
    ),
    Criterion.SHADOW_EDGE: Look(
        "shadow_edge", "near a shadow's edge", (255, 184, 0),
        "A pixel of error puts it on the other side of the edge. shadow_margin says how far is "
        "near; a large lamp casts soft edges: make shadow masks.",
    ),
    Criterion.OUTLINE: Look(
        "outline", "near an outline", (255, 243, 51),
        "A pixel of error puts it on another surface. silhouette_margin says how far is near.",
    ),
    Criterion.GRAZING: Look(
        "grazing", "grazing", (196, 10, 55),
        "Seen or lit so flatly that a small error of the mesh changes the result by much. Photos "
        "from the front, and lamps beside the camera, see it better; smallest_cosine is the "
        "limit.",
    ),
    Criterion.MASK_BORDER: Look(
        "mask_border", "at a mask's border", (255, 134, 95),
        "Its pixel may show both materials. mask_margin says how far is near.",
    ),
    Criterion.UNUSABLE: Look(
        "unusable", "clipped", (210, 104, 15),
        "Too bright for the photo (of a bracket: for all its exposures), so that its light is not "
        "known. Expose less, or take a bracket.",
    ),
    Criterion.MISSED: Look(
        "missed", "missed by the light", (76, 93, 0),
        "The lamp's beam all but misses it: there is nothing to measure.",
    ),
    Criterion.CURVED: Look(
        "curved", "too curved", (255, 249, 215),
        "More curved than the paper's method believes a scan. Its threshold is [fit] curvature; "
        "the measured method uses such pixels.",
    ),
    Criterion.RELIABLE: Look(
        "reliable", "reliable", (0, 147, 155),
        "A sample: what the material is measured from.",
    ),
}  # fmt: skip

PALETTE: NDArray[np.uint8] = np.array([LOOKS[c].colour for c in Criterion], np.uint8)
"""(criteria, 3) sRGB of each, by its number."""
SPARE = (121, 226, 225)
"""Reliable, but not among the random part of the samples that a fit was given."""
