"""A fitted material as maps need it, from a result on disk or from a fit just done."""

from __future__ import annotations

from dataclasses import dataclass

from ..appearance.principled import Principled
from ..basis import PrincipalBRDF
from ..capture import Capture
from ..errors import InputError
from ..fit.measured_result import MeasuredResult
from ..jobs import CaptureResult
from ..result import FittedResult
from .labels import MOST_MATERIALS


@dataclass(frozen=True)
class MapMaterial:
    """name; brdf: ρ in 1/sr; principled: the Principled that was fitted to it; scale: what the
    photos' reflectance was multiplied by; normal_deviation: degrees per tangent."""

    name: str
    brdf: PrincipalBRDF
    principled: Principled
    scale: float
    normal_deviation: float


def from_result(capture: Capture, fitted: FittedResult) -> tuple[MapMaterial, ...]:
    """The materials in the capture's order. Raises InputError where one is missing."""
    if len(capture.materials) > MOST_MATERIALS:
        raise InputError(
            f"has {len(capture.materials)} materials, maps are made of {MOST_MATERIALS} at most",
            file=capture.file,
        )
    there = {m.name: m for m in fitted.materials}
    for entry in capture.materials:
        if entry.name not in there:
            raise InputError(
                f"holds no material {entry.name!r} of {capture.file.name}; it has: "
                f"{', '.join(there)}. Give the result of this capture's fit",
                file=fitted.file,
            )
    return tuple(
        MapMaterial(m.name, m.brdf, m.principled, m.scale, m.normal_deviation)
        for m in (there[entry.name] for entry in capture.materials)
    )


def from_fit(result: CaptureResult) -> tuple[MapMaterial, ...]:
    """The materials of a fit just done, in the capture's order."""
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
