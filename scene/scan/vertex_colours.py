"""Colour attributes of the scanned mesh that show values on a scale."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

LOW, MIDDLE, HIGH = np.array([[59, 76, 192], [236, 236, 236], [180, 4, 38]]) / 255
UNOBSERVED = np.array([0.04, 0.042, 0.05])


def colours_of(values: Array) -> Array:
    """(n, 3) sRGB colours of values (n,) from −1 to 1; UNOBSERVED for NaN."""
    part = np.clip(np.nan_to_num(values), -1, 1)[:, None]
    end = np.where(part < 0, LOW, HIGH)
    colour = MIDDLE + (end - MIDDLE) * np.abs(part)
    return np.where(np.isnan(values)[:, None], UNOBSERVED, colour)


def paint_vertices(mesh: bpy.types.Mesh, name: str, values: Array) -> None:
    """Add the attribute ``name`` with the colours of values (v,)."""
    colour = colours_of(values)
    rgba = np.concatenate([colour, np.ones((len(colour), 1))], axis=1).astype(np.float32)
    layer = mesh.color_attributes.new(name, "BYTE_COLOR", "POINT")
    layer.data.foreach_set("color_srgb", rgba.ravel())


def drop_vertex_colours(mesh: bpy.types.Mesh, prefix: str) -> None:
    """Remove the attributes whose names begin with ``prefix``."""
    attributes = mesh.color_attributes
    for name in [a.name for a in attributes if a.name.startswith(prefix)]:
        attributes.remove(attributes[name])
