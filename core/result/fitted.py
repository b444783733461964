"""The saved result of a fit as core types."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..appearance.principled import Principled
from ..basis import Basis, PrincipalBRDF
from ..errors import InputError


@dataclass(frozen=True)
class HeldOutError:
    """Errors of the held-out photos, each predicted from the others. error: ‖L̂ − L‖/‖L‖ over all
    of them; typical: median relative error of pixels that are not dark."""

    error: float
    typical: float


@dataclass(frozen=True)
class FittedMaterial:
    """One material of a result.

    brdf: coefficients (3, k) in the basis of the fit, ρ in 1/sr. principled: the fitted Principled
    BSDF; principled_error, lambertian_error: its relative cube-root error and that of the best
    Lambertian BRDF. scale_known: False where the irradiance was unknown; ρ was then multiplied by
    ``scale`` and is known up to one factor. held_out: None where no photo was held out.
    normal_deviation: standard deviation of the scan's normals along each tangent, degrees; 0 where
    the fit does not estimate it.
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
    """A result folder. file: its result.json; program: version of Patina that wrote it; capture:
    path of the capture file at the time of the fit; scene: the folder's scene.blend, None where
    there is none. effects: causes that the materials take into account, with their parameters by
    name. varying: the folder's file of the variation over the surface, None where there is none;
    varying_names: the materials that vary; separated_from: the material of the capture whose parts
    the materials are, None where they are those of the capture."""

    file: Path
    program: str
    capture: str
    basis: Basis
    materials: tuple[FittedMaterial, ...]
    scene: Path | None
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    varying: Path | None = None
    varying_names: tuple[str, ...] = ()
    separated_from: str | None = None

    def materials_of(self, names: Sequence[str], capture: str) -> tuple[FittedMaterial, ...]:
        """The materials with these names of a capture, in their order, or the parts that its only
        material was separated into. Raises InputError if one is missing."""
        if self.separated_from is not None and list(names) == [self.separated_from]:
            return self.materials
        there = {material.name: material for material in self.materials}
        for name in names:
            if name not in there:
                raise InputError(
                    f"found the materials {', '.join(there)}; expected {name!r} of {capture} too; "
                    "give the result of a fit of this capture",
                    file=self.file,
                )
        return tuple(there[name] for name in names)
