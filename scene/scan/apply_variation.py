"""Show the variation of a fit on the materials of a scene, as maps packed in the .blend."""

from __future__ import annotations

import tempfile
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from ...core.concurrency.job import finished
from ...core.concurrency.steps import relayed
from ...core.errors import PatinaError
from ...core.jobs import CaptureResult
from ...core.maps.bake_job import BakeJob
from ...core.scan import Mesh
from ...core.varying.surface_grid import SurfaceGrid
from ..property_keys import MAP_KIND
from ..session.child_processes import in_child_of_window
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
        with tempfile.TemporaryDirectory(prefix="patina_maps_", dir=bpy.app.tempdir) as folder:
            baking = BakeJob(result, scan, made_uv, size, Path(folder))
            baked = yield from relayed(in_child_of_window(baking), lambda step: None)
            return (yield from _applied(scene, baked))
    except PatinaError as error:
        return [f"The materials vary over the surface, but are shown as even, because {error}"]


def _applied(scene: bpy.types.Scene, baked: BakeJob) -> Generator[None, None, list[str]]:
    """Put the maps on the materials, and pack them; one piece per step. Returns notes."""
    maps = finished(baked.maps)
    before = set(bpy.data.images)
    notes = apply_maps(scene, maps, baked.folder, baked.files)
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
