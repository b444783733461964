"""Colour attributes on the scanned mesh: the residual, and the change by each cause."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...core.diagnose.forward.pixels import Pixels
from ...core.diagnose.selection.diagnosis import Diagnosis
from ..property_keys import EVIDENCE_COLOURS

Array = NDArray[np.floating]

RESIDUAL = "residual"  # attribute of the residual
NEIGHBOURS = 8  # nearest pixels whose median colours a vertex
FULL_SCALE = 0.10  # relative change of the pixel value with the full colour
DARKER, SAME, BRIGHTER = np.array([[59, 76, 192], [236, 236, 236], [180, 4, 38]]) / 255
UNOBSERVED = np.array([0.04, 0.042, 0.05])


def paint_evidence(
    thing: bpy.types.Object, vertices: Array, pixels: Pixels, found: Diagnosis
) -> bool:
    """Write the attributes of a check, in place of those of an earlier one.

    vertices: (v, 3) of the scan, in its own frame; pixels: the sampled pixels of the check. Returns
    False if the mesh no longer has the scan's vertices.
    """
    drop_evidence(thing)
    if len(thing.data.vertices) != len(vertices):
        return False
    before = found.before.predicted.mean(axis=1)
    level = np.maximum(before, 0.05 * np.percentile(before, 90))
    residual = (pixels.observed.mean(axis=1) - before) / level
    colours = {RESIDUAL: residual}
    for trial in found.accepted:
        shown = trial.fitted.predicted.mean(axis=1)
        colours[trial.effect.cause] = (shown - before) / level
    mesh = thing.data
    distance, near = cKDTree(pixels.point).query(vertices, min(NEIGHBOURS, len(pixels)))
    near, distance = near.reshape(len(vertices), -1), distance.reshape(len(vertices), -1)
    observed = distance[:, 0] < 4 * np.median(distance[:, 0]) + 1e-9
    for name, values in colours.items():
        _paint(mesh, EVIDENCE_COLOURS + name, np.median(values[near], axis=1), observed)
    return True


def show_evidence(thing: bpy.types.Object, cause: str) -> bool:
    """Make the attribute of a cause the active colour, which Solid shading shows; False if it does
    not exist."""
    attributes = thing.data.color_attributes
    wanted = attributes.get(EVIDENCE_COLOURS + cause)
    if wanted is None:
        return False
    attributes.active_color = wanted
    return True


def drop_evidence(thing: bpy.types.Object) -> None:
    """Remove the attributes of the last check."""
    attributes = thing.data.color_attributes
    for name in [a.name for a in attributes if a.name.startswith(EVIDENCE_COLOURS)]:
        attributes.remove(attributes[name])


def _paint(mesh: bpy.types.Mesh, name: str, values: Array, observed: NDArray[np.bool_]) -> None:
    part = np.clip(values / FULL_SCALE, -1, 1)[:, None]
    end = np.where(part < 0, DARKER, BRIGHTER)
    colour = np.where(observed[:, None], SAME + (end - SAME) * np.abs(part), UNOBSERVED)
    rgba = np.concatenate([colour, np.ones((len(colour), 1))], axis=1).astype(np.float32)
    layer = mesh.color_attributes.new(name, "BYTE_COLOR", "POINT")
    layer.data.foreach_set("color_srgb", rgba.ravel())
