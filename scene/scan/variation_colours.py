"""Colour attributes on the scanned mesh that show how its materials vary."""

from __future__ import annotations

from collections.abc import Generator, Mapping

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.varying.varying_surface import VaryingSurface
from ...core.views.surface_view import QUANTITIES, at_vertices
from ..property_keys import VARIATION_COLOURS
from .vertex_colours import drop_vertex_colours, paint_vertices

MIN_VERTICES = 500  # of the mesh, below which its vertices are too far apart to show a surface


def paint_variation_steps(
    thing: bpy.types.Object | None,
    surface: VaryingSurface | None,
    colours: Mapping[str, NDArray[np.float32]] | None = None,
) -> Generator[None, None, None]:
    """Write the attributes of a fit, in place of those of an earlier one. None are written where
    the mesh no longer has the vertices of the scan, or too few. surface: None where all materials
    are even. colours: at_vertices(surface), if it is computed already. One piece per step."""
    if thing is None or thing.type != "MESH":
        return
    drop_vertex_colours(thing.data, VARIATION_COLOURS)
    count = len(thing.data.vertices)
    if surface is None or count < MIN_VERTICES or count != len(surface.grid.mesh.vertices):
        return
    for kind, values in (colours or at_vertices(surface)).items():
        paint_vertices(thing.data, VARIATION_COLOURS + kind, values)
        yield


def painted_kinds(thing: bpy.types.Object | None) -> list[str]:
    """The kinds that the mesh has colours for."""
    if thing is None or thing.type != "MESH":
        return []
    attributes = thing.data.color_attributes
    return [kind for kind in QUANTITIES if VARIATION_COLOURS + kind in attributes]
