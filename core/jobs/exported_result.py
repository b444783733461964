"""Convert a fit in memory to the type that exporters read from disk."""

from __future__ import annotations

from pathlib import Path

from ..fit.measured_result import MeasuredResult
from ..result.fitted import FittedMaterial, FittedResult, HeldOutError
from .fit_job import CaptureResult, MaterialResult


def exported_result(result: CaptureResult, file: Path, program: str) -> FittedResult:
    """The FittedResult that reading ``file``, the result.json of ``result``, would give.

    program: version of Patina that wrote it. The materials must have their portable forms.
    """
    return FittedResult(
        file=file,
        program=program,
        capture=str(result.capture.file),
        basis=result.basis,
        materials=tuple(_material(material) for material in result.materials),
        scene=None,
    )


def _material(material: MaterialResult) -> FittedMaterial:
    fit, held = material.fit, material.held_out
    measured = isinstance(fit, MeasuredResult)
    return FittedMaterial(
        name=material.name,
        brdf=fit.brdf,
        principled=material.principled.principled,
        principled_error=material.principled.error,
        lambertian_error=material.principled.diffuse_error,
        estimator="measured" if measured else "paper",
        scale_known=material.irradiance_known,
        scale=material.scale,
        held_out=None if held is None else HeldOutError(held.error, held.typical),
        normal_deviation=fit.normal_deviation if isinstance(fit, MeasuredResult) else 0.0,
        warnings=material.warnings,
    )
