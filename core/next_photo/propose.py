"""Choose the next photo: the one after which a fit is expected to know most.

A photo adds cells in the regions of angle space that it shows. With the Gaussian posterior of a
fit, the variance after it follows without its content (Bayesian experimental design; Chaloner and
Verdinelli 1995, A-optimality). All pairs of a camera of the scan and a lamp are compared, with what
each camera sees and each lamp reaches on the mesh.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
    lamp_directions,
    lit_from,
    mounted_direction,
    moves_with_camera,
    seen_from,
    view_of,
)
from .sought import SoughtDirections

Array = NDArray[np.float64]

MIN_GAIN = 0.02  # relative decrease of the deviation: less is not worth a photo


@dataclass(frozen=True)
class NextPhoto:
    """A proposal. camera: label of the scan's camera whose viewpoint it shares. towards: (3,) unit
    direction from the object to the lamp, scan frame; None for the flash on the camera. before,
    after: RMS standard deviation of ln(ρ·cosMap + ε) over lights and views within 80° of the
    normal, mean of the materials, now and as expected after the photo."""

    camera: str
    towards: Array | None
    before: float
    after: float

    @property
    def gain(self) -> float:
        """Relative decrease of the deviation."""
        return 1.0 - self.after / self.before


@dataclass(frozen=True)
class MaterialSought:
    """One material: points of its surface, and what is not known about it."""

    surface: SurfacePoints
    sought: SoughtDirections


def propose(
    rays: RayScene,
    cameras: Sequence[Camera],
    lights: Sequence[Light],
    materials: Sequence[MaterialSought],
) -> NextPhoto | None:
    """The best next photo, None where no photo gains MIN_GAIN.

    cameras: of the scan. lights: of the lit photos: with a flash on the camera, only the camera is
    chosen.
    """
    best: NextPhoto | None = None
    for _, found in evaluated(rays, cameras, lights, materials):
        if best is None or found.after < best.after:
            best = found
    return best if best is not None and best.gain >= MIN_GAIN else None


def evaluated(
    rays: RayScene,
    cameras: Sequence[Camera],
    lights: Sequence[Light],
    materials: Sequence[MaterialSought],
) -> Iterator[tuple[float, NextPhoto]]:
    """(fraction of the cameras done, the best photo from that camera) for each camera."""
    chosen = chosen_cameras(cameras)
    flash = moves_with_camera(lights)
    centre = np.mean([m.surface.point.mean(axis=0) for m in materials], axis=0)
    lamps = lamp_directions(chosen, centre)
    before = float(np.mean([m.sought.deviation() for m in materials]))
    lit = []
    if flash is None:
        for material in materials:
            each = [np.broadcast_to(lamp, material.surface.point.shape) for lamp in lamps]
            lit.append([lit_from(rays, material.surface, towards) for towards in each])
    for done, camera in enumerate(chosen, 1):
        after = []
        for place, material in enumerate(materials):
            surface = material.surface
            seen = seen_from(rays, surface, camera)
            if flash is not None:
                towards = mounted_direction(flash, camera, surface)
                shown = seen & lit_from(rays, surface, towards)
                counts = _counts(surface, view_of(surface, camera), [(towards, shown)])
            else:
                pairs = [
                    (np.broadcast_to(lamp, surface.point.shape), seen & own)
                    for lamp, own in zip(lamps, lit[place], strict=True)
                ]
                counts = _counts(surface, view_of(surface, camera), pairs)
            after.append(np.sqrt(material.sought.variance_after(counts)))
        mean = np.mean(after, axis=0)
        best = int(np.argmin(mean))
        yield (
            done / len(chosen),
            NextPhoto(
                camera.label, None if flash is not None else lamps[best], before, float(mean[best])
            ),
        )


def _counts(
    surface: SurfacePoints, view: Array, pairs: Sequence[tuple[Array, NDArray[np.bool_]]]
) -> NDArray[np.intp]:
    """(photos, parts) how many points each photo shows in each part of a region. pairs: for each
    photo unit directions to the lamp (n, 3) and which points it shows (n,)."""
    shown = [np.flatnonzero(own) for _, own in pairs]
    which = np.concatenate(shown)
    photo = np.repeat(np.arange(len(pairs)), [len(own) for own in shown])
    towards = np.concatenate([light[own] for (light, _), own in zip(pairs, shown, strict=True)])
    angles = half_difference(surface.normal[which], towards, view[which])
    flat = photo * regions.COUNT + regions.part_of(angles)
    counts = np.bincount(flat, minlength=len(pairs) * regions.COUNT)
    return counts.reshape(len(pairs), regions.COUNT)
