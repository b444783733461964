"""Colour attributes on the scanned mesh: the residual, and the change by each cause."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...core.diagnose.forward.pixels import Pixels
from ...core.diagnose.selection.diagnosis import Diagnosis
from ..property_keys import EVIDENCE_COLOURS
from .vertex_colours import drop_vertex_colours, paint_vertices

Array = NDArray[np.floating]

RESIDUAL = "residual"  # attribute of the residual
NEIGHBOURS = 8  # nearest pixels whose median colours a vertex
FULL_SCALE = 0.10  # relative change of the pixel value with the full colour


def paint_evidence(
    thing: bpy.types.Object, vertices: Array, pixels: Pixels, found: Diagnosis
) -> bool:
    """Write the attributes of a check, in place of those of an earlier one.

    vertices: (v, 3) of the scan, in its own frame; pixels: the sampled pixels of the check. Returns
    False if the mesh no longer has the scan's vertices.
    """
    drop_vertex_colours(thing.data, EVIDENCE_COLOURS)
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
        median = np.median(values[near], axis=1) / FULL_SCALE
        paint_vertices(mesh, EVIDENCE_COLOURS + name, np.where(observed, median, np.nan))
    return True
