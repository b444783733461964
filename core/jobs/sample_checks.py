"""Errors where the samples of a capture cannot be right: nothing seen, nothing lit, too dark."""

from __future__ import annotations

from collections import Counter

import numpy as np

from ..capture import Capture, LightEntry
from ..samples import SampleTable
from .sampling import PhotoSamples

MIN_RHO, MAX_RHO = 1e-6, 1e4  # 1/sr: black velvet has 1e-3, peaks of mirrors 1e4


def check_light(capture: Capture, taken: PhotoSamples) -> None:
    """Raise InputError where no photo shows the mesh, or no surface that is seen is lit."""
    seen_by, lit_by = (Counter[str](), Counter[str]())
    for place, photo in enumerate(capture.photos):
        seen_by[photo.light] += int(taken.seen[place])
        lit_by[photo.light] += int(taken.lit[place])
    if not any(seen_by.values()):
        raise capture.error(
            "no lit photo shows any part of the mesh; check that mesh and cameras belong together",
            "scan",
            "mesh",
        )
    for place, light in enumerate(capture.lights):
        if seen_by[light.name] and lit_by[light.name] == 0:
            raise capture.error(
                f"the light {light.name!r} is behind every surface that its photos show: no "
                "pixel is lit; "
                + (
                    "expected a direction from the surface TO the light, in the scan's frame"
                    if light.distant
                    else "expected a position outside the object, in scan units"
                ),
                "light", place, _location_key(light),
            )  # fmt: skip


def check_samples(
    capture: Capture, index: int, table: SampleTable, marked: int, known: bool
) -> None:
    """Raise InputError where a material has no samples, or such as no surface has.

    index: of the material; marked: pixels that masks or faces mark as it; known: whether the
    irradiance is."""
    name = capture.materials[index].name
    if len(table):
        level = float(np.median(table.rho.mean(axis=1)))
        if level <= 0 or (known and not MIN_RHO < level < MAX_RHO):
            raise capture.error(
                f"the median BRDF of {name!r} is {level:.3g} 1/sr, which no real surface has; "
                "check that light directions point from the surface TO the light, that the "
                "photos are linear and not black, and check exposure and irradiance",
                *material_entry(capture, index),
            )
        return
    painted = capture.named_by_masks(name)
    found = (
        f"all pixels are masked out: no mask marks any part of the mesh as {name!r}"
        if painted and marked == 0
        else f"none of the {marked} pixels of {name!r} is lit and away from shadow edges"
    )
    raise capture.error(found, *material_entry(capture, index))


def material_entry(capture: Capture, index: int) -> tuple[str | int, ...]:
    """The key that errors about a material name: its own, or the first photo's file where the
    capture has no [[material]] table."""
    own = ("material", index, "name")
    return own if own in capture.lines else ("photo", 0, "file")


def _location_key(entry: LightEntry) -> str:
    """The key of a [[light]] table that gives the light's direction or position."""
    keys = ("sphere", "sun", "position", "mounted")
    return next((key for key in keys if getattr(entry, key) is not None), "direction")
