"""Show the variation of a fit on the materials of a scene, as maps packed in the .blend."""

from __future__ import annotations

import tempfile
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from ...core.concurrency.background import in_background
from ...core.errors import PatinaError
from ...core.jobs import CaptureResult
from ...core.maps.maps_result import MapsResult, baked_maps
from ...core.maps.material import from_fit
from ...core.maps.texels import rasterise
from ...core.maps.write import write_maps
from ...core.scan import Mesh
from ...core.varying.surface_grid import SurfaceGrid
from ..property_keys import MAP_KIND
from .apply_maps import apply_maps
from .unwrap import unwrapped

MIN_SIZE, MAX_SIZE = 256, 4096  # texels a side of a map


def apply_variation_steps(
    scene: bpy.types.Scene, result: CaptureResult
) -> Generator[None, None, list[str]]:
    """Make the maps of a fit with materials that vary, and put them on these; one piece per step.
    Returns notes for the user."""
    surface, scan = result.varying, result.scan
    if surface is None:
        return []
    made_uv = scan.mesh.uv is None
    try:
        if made_uv:
            scan = replace(scan, mesh=replace(scan.mesh, uv=unwrapped(scan.mesh)))
            yield
        size = map_size(scan.mesh, surface.grid)

        def bake() -> MapsResult:
            texels = rasterise(scan.mesh, size)
            own = from_fit(result)
            return baked_maps(result.capture, scan, texels, surface, own, made_uv)

        maps = yield from in_background(bake, None)
    except PatinaError as error:
        return [f"The materials vary over the surface, but are shown as even, because {error}"]
    with tempfile.TemporaryDirectory(prefix="patina_maps_") as name:
        folder = Path(name)
        # colours in sRGB: Blender's glTF exporter writes linear ones as if they were in sRGB
        files = yield from in_background(lambda: write_maps(folder, maps, "exr", "png"), None)
        before = set(bpy.data.images)
        notes = apply_maps(scene, maps, folder, files)
        for image in set(bpy.data.images) - before:
            image.pack()
            image[MAP_KIND] = True
            image.filepath = f"//{image.name}"  # where Blender would unpack it
            yield
    return [*maps.notes, *notes]


def map_size(mesh: Mesh, grid: SurfaceGrid) -> int:
    """Texels a side, a power of two, for about one texel per node."""
    assert mesh.uv is not None
    first, second = (mesh.uv[:, k].astype(float) - mesh.uv[:, 0] for k in (1, 2))
    covered = 0.5 * float(np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum())
    wanted = np.sqrt(len(grid) / max(covered, 1e-3))
    return int(np.clip(2 ** round(np.log2(max(wanted, 1.0))), MIN_SIZE, MAX_SIZE))
