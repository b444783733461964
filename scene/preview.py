"""The sphere by which a measured material is recognised."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.basis import PrincipalBRDF
from ..core.report import display
from ..core.report.sphere import lit_sphere

SIZE, SMALL = 256, 32  # pixels across a preview, and an icon


def show_sphere(material: bpy.types.Material, brdf: PrincipalBRDF) -> None:
    """The lit sphere of the report as the material's preview, whatever renders it elsewhere."""
    preview = material.preview_ensure()
    if preview is None:  # where Blender makes none
        return
    for size, place in ((SIZE, "image"), (SMALL, "icon")):
        radiance, coverage = lit_sphere(brdf.evaluate, size)
        picture = np.dstack([display.srgb(radiance).astype(np.float32) / 255, coverage])
        setattr(preview, f"{place}_size", (size, size))
        pixels = np.ascontiguousarray(picture[::-1], np.float32).ravel()
        getattr(preview, f"{place}_pixels_float").foreach_set(pixels)
