"""The maps of a capture in memory, and the notes on them for the user."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..jobs import CaptureResult
from ..scan import Scan
from ..varying.node_model import TILT
from ..varying.varying_surface import VaryingSurface
from .level import MaterialLevel
from .material import MapMaterial
from .normals import tangent_normals
from .painted import painted_principled
from .settle import TexelMaps
from .texels import Texels
from .variation import maps_of_variation, normals_of_variation


@dataclass(frozen=True)
class MapsResult:
    """texels: those that the mesh covers; maps: their values; levels, materials: in the order of
    the capture; unwrapped: True if the texture coordinates were made by this job; refit: the fit
    with the colour variation removed, None if none was needed; normal: (n, 3) unit normals of the
    texels in their tangent frames, None if not requested or without enough samples; notes:
    sentences for the user."""

    capture: Capture
    scan: Scan
    texels: Texels
    maps: TexelMaps
    levels: tuple[MaterialLevel, ...]
    materials: tuple[MapMaterial, ...]
    unwrapped: bool
    refit: CaptureResult | None
    normal: NDArray[np.float32] | None
    notes: tuple[str, ...]


def baked_maps(
    capture: Capture,
    scan: Scan,
    texels: Texels,
    surface: VaryingSurface,
    materials: tuple[MapMaterial, ...],
    unwrapped: bool,
) -> MapsResult:
    """The maps of materials whose variation was estimated with the fit. scan: its mesh with texture
    coordinates; texels: of that mesh."""
    levels = tuple(level.divided for level in levels_of(materials))
    normal = None
    if surface.parameters[:, TILT].any():
        normal = tangent_normals(
            scan.mesh, texels, lambda part: normals_of_variation(scan.mesh, texels, surface, part)
        )
    return MapsResult(
        capture,
        scan,
        texels,
        maps_of_variation(texels, surface, levels),
        levels,
        with_dielectrics(materials, levels),
        unwrapped,
        None,
        normal,
        notes_of(texels, levels, unwrapped, False),
    )


def levels_of(materials: tuple[MapMaterial, ...]) -> tuple[MaterialLevel, ...]:
    """The materials, split into body and specular part."""
    return tuple(MaterialLevel.of(m.name, m.brdf, m.scale, m.normal_deviation) for m in materials)


def with_dielectrics(
    materials: tuple[MapMaterial, ...], levels: tuple[MaterialLevel, ...]
) -> tuple[MapMaterial, ...]:
    """The materials with Principled BSDFs that suit a map of the diffuse colour."""
    return tuple(
        replace(m, principled=painted_principled(level, m.principled))
        for m, level in zip(materials, levels, strict=True)
    )


def notes_of(
    texels: Texels, levels: tuple[MaterialLevel, ...], unwrapped: bool, refitted: bool
) -> tuple[str, ...]:
    """Sentences for the user."""
    notes = []
    if refitted:
        notes.append(
            "The colour varies over the surface. The BRDF was fitted again to samples with this "
            "variation removed; the new fit is written to the folder of the maps. Its errors on "
            "held-out photos are those of photos without the variation."
        )
    if unwrapped:
        notes.append(
            "The mesh has no texture coordinates. They were made by Blender's Smart UV Project."
        )
    if texels.overlapped:
        share = 100 * texels.overlapped / len(texels)
        notes.append(
            f"{share:.1f} % of the texels are covered by more than one face (overlapping UVs). The "
            "first of these faces is used."
        )
    if texels.outside:
        notes.append(
            f"{texels.outside:,} faces have texture coordinates outside 0 … 1. They get no map."
        )
    notes += [
        f"{level.name}: only {100 * level.split.share:.0f} % of the reflected light is diffuse. "
        "The maps therefore scale the whole reflectance."
        for level in levels
        if level.split.whole
    ]
    return tuple(notes)
