"""What a fit left behind, in the types that it was made of."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..appearance.principled import Principled
from ..basis import Basis, PrincipalBRDF


@dataclass(frozen=True)
class HeldOutError:
    """How well each photo was predicted from the others: error ‖L̂ − L‖/‖L‖ of all of them,
    typical: median relative error of pixels that are not dark."""

    error: float
    typical: float


@dataclass(frozen=True)
class FittedMaterial:
    """One material of a result.

    brdf: coefficients (3, k) in the basis they were fitted in, ρ in 1/sr. principled: the
    Principled that was fitted, with its relative cube-root error (and the best Lambertian's).
    scale_known: False where no irradiance was known; then ρ was multiplied by ``scale``, and is
    known up to one factor. held_out: None where there was one photo only. normal_deviation: degrees
    along each tangent that the scan's normals are off by, 0 where the fit does not say.
    """

    name: str
    brdf: PrincipalBRDF
    principled: Principled
    principled_error: float
    lambertian_error: float
    estimator: str
    scale_known: bool
    scale: float
    held_out: HeldOutError | None
    normal_deviation: float
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class FittedResult:
    """A result folder. file: its result.json; program: the version that wrote it; capture: the
    capture file as it was told then; scene: the folder's scene.blend where there is one."""

    file: Path
    program: str
    capture: str
    basis: Basis
    materials: tuple[FittedMaterial, ...]
    scene: Path | None
