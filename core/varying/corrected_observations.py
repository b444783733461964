"""Observations of a surface, corrected for the causes that a diagnosis named.

The radiance is corrected with the whole joint fit, whose prediction knows how the surface varies.
Light and normals are those of the named causes alone: the variation is to be estimated from the
corrected observations.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..concurrency.steps import drained
from ..diagnose.correction.sample_correction import correct_samples
from ..diagnose.correction.sample_pixels import pixels_of_samples
from ..diagnose.effects.base.capabilities import NeedsPhoto
from ..diagnose.forward.diagnosis_context import DiagnosisContext
from ..diagnose.solver.model import Model
from ..inputs.photos import LitPhotos
from ..scan import Camera, Scan
from .observation_samples import samples_of
from .observations import Observations


@dataclass(frozen=True)
class ObservationCorrection:
    """model: the joint fit with the causes; named: the same with these causes alone. context: of
    the diagnosis; capture, scan, photos: that it examined."""

    model: Model
    named: Model
    context: DiagnosisContext
    capture: Capture
    scan: Scan
    photos: LitPhotos

    @classmethod
    def of(
        cls,
        model: Model,
        causes: Collection[str],
        context: DiagnosisContext,
        capture: Capture,
        scan: Scan,
        photos: LitPhotos,
    ) -> ObservationCorrection:
        """causes: the effects of the joint fit that are no property of the surface."""
        places = [k for k, effect in enumerate(model.effects) if effect.cause in causes]
        effects, x = tuple(model.effects[k] for k in places), tuple(model.x[k] for k in places)
        named = Model(model.pixels, model.brdfs, effects, x)
        return cls(model, named, context, capture, scan, photos)

    def __call__(
        self,
        seen: Observations,
        camera: Camera,
        points: NDArray[np.float64],
        normals: NDArray[np.floating],
    ) -> Observations:
        """The observations of one photo that can be corrected. points, normals: (m, 3) of their
        nodes. Raises InputError for a photo that no longer exists."""
        if not len(seen):
            return seen
        scale = self.context.scale[seen.material, None]
        normal = np.asarray(normals, np.float32)
        table = samples_of(seen, _pixels_at(camera, points), points, normal, scale)
        read = any(isinstance(effect, NeedsPhoto) for effect in self.model.effects)
        pixels = drained(pixels_of_samples(table, 0, self.capture, self.scan, self.photos, read))
        pixels = replace(pixels, material=seen.material.astype(np.int16))
        found = drained(correct_samples(table, pixels, self.model, self.context, shown=self.named))
        good = np.flatnonzero(found.table.read)
        order = np.argsort(found.rows[good], kind="stable")
        good, rows = good[order], found.rows[good][order]
        table = found.table.select(good)
        return replace(
            seen.select(rows),
            radiance=table.radiance,
            light=table.light,
            irradiance=table.irradiance * scale[rows],
        )


def _pixels_at(camera: Camera, points: NDArray[np.float64]) -> NDArray[np.int32]:
    """(m,) flat indices of the pixels that show points (m, 3)."""
    across, down = np.floor(camera.project(points)).astype(np.int64).T
    across, down = np.clip(across, 0, camera.width - 1), np.clip(down, 0, camera.height - 1)
    return (down * camera.width + across).astype(np.int32)
