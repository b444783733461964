"""Write painted masks as files, for other programs and for capture files."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ...core.photo.image import write_png
from ..scan.scan_rays import scan_rays
from .mask_images import mask_images, read_mask_image
from .paint_kinds import paints, slots_of_faces


def write_masks(scene: bpy.types.Scene, capture: str, folder: Path) -> list[Path]:
    """Write masks as 8-bit PNG files (white: inside) and return their paths.

    There is one file for each photo and material in it, and one for each photo and mask. Raises
    InputError if the capture cannot be read.
    """
    found, mesh, files = scan_rays(capture), scene.patina.mesh, []
    folder.mkdir(parents=True, exist_ok=True)
    materials = [p for p in paints(scene) if p.kind == "material"] if scene.patina.use_slots else []
    stems = [f"{k + 1:03d}_{photo.file.stem}" for k, photo in enumerate(found.capture.photos)]
    slots = slots_of_faces(mesh)
    for place, stem in enumerate(stems if materials else ()):
        slots_shown = found.faces_of(place).image(slots)
        for paint in materials:
            mask = slots_shown == paint.slot
            if mask.any():
                files.append(folder / f"{stem}_{bpy.path.clean_name(paint.name)}.png")
                write_png(files[-1], mask * np.uint8(255))
    for (place, kind), image in sorted(mask_images(capture).items()):
        if place < len(stems):
            files.append(folder / f"{stems[place]}_{kind}.png")
            write_png(files[-1], read_mask_image(image) * np.uint8(255))
    return files
