"""The photo to take next, for the materials of a fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..fit import PaperFit
from ..fit.measured_result import MeasuredResult
from ..geometry import RayScene
from ..inputs.lights import Lights
from ..proposed_photo import DirectionUncertainty, MaterialToPhotograph, ProposedPhoto, propose
from ..proposed_photo.candidates import SurfacePoints
from ..scan import Scan


def proposed_photo(
    scan: Scan,
    rays: RayScene,
    lights: Lights,
    fits: Sequence[PaperFit | MeasuredResult],
    face_material: NDArray[np.int32],
) -> ProposedPhoto | None:
    """The photo that would say most about the materials; None where no photo would say much, or
    where the method of the fit has no posterior.

    fits: of the materials. face_material: (f,) index of the material of each face.
    """
    materials = []
    for place, fit in enumerate(fits):
        faces = np.flatnonzero(face_material == place)
        surface = SurfacePoints.of(scan.mesh, faces)
        if isinstance(fit, MeasuredResult) and surface is not None:
            materials.append(MaterialToPhotograph(surface, DirectionUncertainty.of(fit)))
    return propose(rays, scan.cameras, list(lights.by_name.values()), materials)
