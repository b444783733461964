"""Preview and icon of a measured material: a lit sphere."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from ...core.basis import PrincipalBRDF
from ...core.views import display
from ...core.views.prepared_materials import Picture, spheres


def show_sphere(material: bpy.types.Material, brdf: PrincipalBRDF) -> None:
    """Set the material's preview and icon to the lit sphere that reports show."""
    set_preview(material, spheres(brdf))


def set_preview(material: bpy.types.Material, pictures: Sequence[Picture]) -> None:
    """Set preview and icon of a material to pictures of any size."""
    preview = material.preview_ensure()
    if preview is None:  # this Blender creates no previews
        return
    for (radiance, coverage), place in zip(pictures, ("image", "icon"), strict=True):
        size = len(coverage)
        picture = np.dstack([display.srgb(radiance).astype(np.float32) / 255, coverage])
        setattr(preview, f"{place}_size", (size, size))
        pixels = np.ascontiguousarray(picture[::-1], np.float32).ravel()
        getattr(preview, f"{place}_pixels_float").foreach_set(pixels)
