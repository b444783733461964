"""Choose the next photo: the one after which a fit is expected to know most.

A photo adds cells in the regions of angle space that it shows. With the Gaussian posterior of a
fit, the variance after it follows without its content (Bayesian experimental design; Chaloner and
Verdinelli 1995, A-optimality). All pairs of a camera of the scan and a lamp are compared, with what
each camera sees and each lamp reaches on the mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..geometry import RayScene
from ..light import Light
from ..scan import Camera
from . import regions
from .candidates import (
    SurfacePoints,
    chosen_cameras,
    directions_to,
    in_picture,
    lamp_directions,
    lit_from,
    moves_with_camera,
    seen_from,
    too_grazing,
)
from .proposal import ProposedPhoto
from .uncertainty import DirectionUncertainty

Array = NDArray[np.float64]

MIN_GAIN = 0.02  # relative decrease of the deviation: less is not worth a photo


@dataclass(frozen=True)
class MaterialToPhotograph:
    """One material: points of its surface, and what is not known about it."""

    surface: SurfacePoints
    uncertainty: DirectionUncertainty


def propose(
    rays: RayScene,
    cameras: Sequence[Camera],
    lights: Sequence[Light],
    materials: Sequence[MaterialToPhotograph],
) -> ProposedPhoto | None:
    """The best next photo, None where no photo gains MIN_GAIN.

    cameras: of the scan. lights: of the lit photos: with a flash on the camera, only the camera is
    chosen.
    """
    if not materials:
        return None
    centre = np.mean([m.surface.point.mean(axis=0) for m in materials], axis=0)
    chosen = chosen_cameras(cameras, centre)
    if not chosen:
        return None
    flash = moves_with_camera(lights)
    lamps = lamp_directions(chosen, centre)
    before = float(np.mean([m.uncertainty.deviation() for m in materials]))
    lit = [[] if flash is not None else _lit(rays, m.surface, lamps) for m in materials]
    best: ProposedPhoto | None = None
    for camera in chosen:
        after = []
        for material, lit_by in zip(materials, lit, strict=True):
            surface = material.surface
            seen = seen_from(rays, surface, camera)
            if flash is not None:
                light = flash.incidence(surface.point, camera)
                reached = lit_from(rays, surface, light.towards, light.distance)
                photos = [(light.towards, seen & reached)]
            else:
                photos = [(towards, seen & own) for towards, own in lit_by]
            counts = _counts(surface, directions_to(camera, surface.point), photos)
            after.append(np.sqrt(material.uncertainty.variance_after(counts)))
        mean = np.mean(after, axis=0)
        if flash is None:
            useless = in_picture(camera, lamps) | too_grazing(camera, centre, lamps)
            mean = np.where(useless, np.inf, mean)
        place = int(np.argmin(mean))
        if np.isfinite(mean[place]) and (best is None or mean[place] < best.after):
            lamp = None if flash is not None else lamps[place]
            best = ProposedPhoto.of(camera, centre, lamp, before, float(mean[place]))
    return best if best is not None and best.gain >= MIN_GAIN else None


def _lit(
    rays: RayScene, surface: SurfacePoints, lamps: Array
) -> list[tuple[Array, NDArray[np.bool_]]]:
    """For each lamp its unit direction at the points (n, 3), and which points it lights (n,)."""
    each = (np.broadcast_to(lamp, surface.point.shape) for lamp in lamps)
    return [(towards, lit_from(rays, surface, towards)) for towards in each]


def _counts(
    surface: SurfacePoints, view: Array, photos: Sequence[tuple[Array, NDArray[np.bool_]]]
) -> NDArray[np.intp]:
    """(photos, parts) how many points each photo shows in each part of a region. photos: unit
    directions to the lamp (n, 3), and which points the photo shows (n,)."""
    shown = [np.flatnonzero(own) for _, own in photos]
    which = np.concatenate(shown)
    photo = np.repeat(np.arange(len(photos)), [len(own) for own in shown])
    towards = np.concatenate([light[own] for (light, _), own in zip(photos, shown, strict=True)])
    angles = half_difference(surface.normal[which], towards, view[which])
    flat = photo * regions.COUNT + regions.part_of(angles)
    counts = np.bincount(flat, minlength=len(photos) * regions.COUNT)
    return counts.reshape(len(photos), regions.COUNT)
