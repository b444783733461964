"""Colour attributes on the scanned mesh: what is missed, and what each cause would change."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...core.diagnose.forward.pixels import Pixels
from ...core.diagnose.selection.diagnosis import Diagnosis

Array = NDArray[np.floating]

EVIDENCE = "Patina: "  # and the cause; of what is missed: MISSED
MISSED = "missed"
NEAREST = 8  # pixels that colour a vertex
FULL = 0.10  # of the photo's light, for full colour
DARKER, SAME, BRIGHTER = np.array([[59, 76, 192], [236, 236, 236], [180, 4, 38]]) / 255
UNSEEN = np.array([0.04, 0.042, 0.05])


def paint_evidence(
    thing: bpy.types.Object, vertices: Array, pixels: Pixels, found: Diagnosis
) -> bool:
    """Replace the attributes of an earlier check. vertices: (v, 3) the scan's own, which need not
    be where Blender has them. False where the mesh no longer has them."""
    drop_evidence(thing)
    if len(thing.data.vertices) != len(vertices):
        return False
    before = found.before.shown.mean(axis=1)
    level = np.maximum(before, 0.05 * np.percentile(before, 90))
    missed = (pixels.observed.mean(axis=1) - before) / level
    colours = {MISSED: missed}
    for trial in found.accepted:
        shown = trial.fitted.shown.mean(axis=1)
        colours[trial.effect.cause] = (shown - before) / level
    mesh = thing.data
    far, near = cKDTree(pixels.point).query(vertices, min(NEAREST, len(pixels)))
    near, far = near.reshape(len(vertices), -1), far.reshape(len(vertices), -1)
    seen = far[:, 0] < 4 * np.median(far[:, 0]) + 1e-9
    for name, values in colours.items():
        _paint(mesh, EVIDENCE + name, np.median(values[near], axis=1), seen)
    return True


def show_evidence(thing: bpy.types.Object, cause: str) -> bool:
    """Make it the colour that Solid shading shows; False where there is none."""
    attributes = thing.data.color_attributes
    wanted = attributes.get(EVIDENCE + cause)
    if wanted is None:
        return False
    attributes.active_color = wanted
    return True


def drop_evidence(thing: bpy.types.Object) -> None:
    """Take the attributes away."""
    attributes = thing.data.color_attributes
    for name in [a.name for a in attributes if a.name.startswith(EVIDENCE)]:
        attributes.remove(attributes[name])


def _paint(mesh: bpy.types.Mesh, name: str, values: Array, seen: NDArray[np.bool_]) -> None:
    part = np.clip(values / FULL, -1, 1)[:, None]
    end = np.where(part < 0, DARKER, BRIGHTER)
    colour = np.where(seen[:, None], SAME + (end - SAME) * np.abs(part), UNSEEN)
    rgba = np.concatenate([colour, np.ones((len(colour), 1))], axis=1).astype(np.float32)
    layer = mesh.color_attributes.new(name, "BYTE_COLOR", "POINT")
    layer.data.foreach_set("color_srgb", rgba.ravel())
