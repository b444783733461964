"""A fitted material as the maps need it, from a result file or from a fit in memory."""

from __future__ import annotations

from dataclasses import dataclass

from ..appearance.principled import Principled
from ..basis import PrincipalBRDF
from ..capture import Capture
from ..fit.measured_result import MeasuredResult
from ..jobs import CaptureResult
from ..result import FittedResult
from ..varying.labels import check_material_count


@dataclass(frozen=True)
class MapMaterial:
    """brdf: ρ in 1/sr; principled: the Principled BSDF fitted to it; scale: factor of the photos'
    reflectance in the fit (1 where irradiance is known); normal_deviation: standard deviation of
    the normals, degrees along each tangent."""

    name: str
    brdf: PrincipalBRDF
    principled: Principled
    scale: float
    normal_deviation: float


def from_result(capture: Capture, fitted: FittedResult) -> tuple[MapMaterial, ...]:
    """The materials in the order of the capture. Raises InputError if one is missing in the result,
    or if there are too many."""
    check_material_count(capture)
    stored = fitted.materials_of([m.name for m in capture.materials], capture.file.name)
    return tuple(
        MapMaterial(m.name, m.brdf, m.principled, m.scale, m.normal_deviation) for m in stored
    )


def from_fit(result: CaptureResult) -> tuple[MapMaterial, ...]:
    """The materials of a fit in memory, in the order of the capture."""
    return tuple(
        MapMaterial(
            m.name,
            m.fit.brdf,
            m.principled.principled,
            m.scale,
            m.fit.normal_deviation if isinstance(m.fit, MeasuredResult) else 0.0,
        )
        for m in result.materials
    )
