"""The sphere by which a measured material is recognised."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.basis import PrincipalBRDF
from ...core.views import display
from ...core.views.sphere import lit_sphere

SIZE, SMALL = 256, 32  # pixels across a preview, and an icon

Picture = tuple[NDArray[np.floating], NDArray[np.floating]]
"""Radiance (size, size, 3) and coverage (size, size) of a sphere."""


def spheres(brdf: PrincipalBRDF) -> list[Picture]:
    """Of a preview and of an icon. Knows nothing of Blender: other threads may ask."""
    return [lit_sphere(brdf.evaluate, size) for size in (SIZE, SMALL)]


def show_sphere(material: bpy.types.Material, brdf: PrincipalBRDF) -> None:
    """The lit sphere of the report as the material's preview, whatever renders it elsewhere."""
    put_spheres(material, spheres(brdf))


def put_spheres(material: bpy.types.Material, pictures: Sequence[Picture]) -> None:
    """Preview and icon, of any sizes."""
    preview = material.preview_ensure()
    if preview is None:  # where Blender makes none
        return
    for (radiance, coverage), place in zip(pictures, ("image", "icon"), strict=True):
        size = len(coverage)
        picture = np.dstack([display.srgb(radiance).astype(np.float32) / 255, coverage])
        setattr(preview, f"{place}_size", (size, size))
        pixels = np.ascontiguousarray(picture[::-1], np.float32).ravel()
        getattr(preview, f"{place}_pixels_float").foreach_set(pixels)
