"""What Blender shows of fitted materials: previews, and tables of the OSL shader. They take
seconds; afterwards Blender only has to store them."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..appearance.lobe_fit import fit_lobe_stack
from ..appearance.principled_fit import fit_principled
from ..appearance.shader_tables import ShaderTables
from ..basis import PrincipalBRDF
from ..concurrency.job import Job, Step
from ..jobs import CaptureResult
from ..varying.split import split_body
from .sphere import lit_sphere
from .surface_view import at_vertices

log = logging.getLogger(__name__)

PREVIEW_SIZE, ICON_SIZE = 256, 32  # width of a preview and of an icon, pixels
JOB_FRACTION = 0.96  # share of the fit in the progress of a PreparedJob
PREPARING = "previews and shaders"  # name of a stage

Picture = tuple[NDArray[np.floating], NDArray[np.floating]]
"""Radiance (size, size, 3) and coverage (size, size) of a sphere."""


class Fitting(Protocol):
    """A job whose result is a CaptureResult."""

    result: CaptureResult | None

    def run(self) -> Iterator[Step]: ...


AnyFit = TypeVar("AnyFit", bound=Fitting)


@dataclass(frozen=True)
class Prepared:
    """Data of one material. spheres: for preview and icon; tables: of the OSL shader, None if it
    cannot run."""

    spheres: list[Picture]
    tables: ShaderTables | None


def spheres(brdf: PrincipalBRDF) -> list[Picture]:
    """The spheres of preview and icon."""
    return [lit_sphere(brdf.evaluate, size) for size in (PREVIEW_SIZE, ICON_SIZE)]


def prepare(brdf: PrincipalBRDF, with_osl: bool) -> Prepared:
    """Compute the data of one material."""
    _ = brdf.basis.version  # computes and caches the checksum of the components for file names
    return Prepared(spheres(brdf), ShaderTables.of(brdf) if with_osl else None)


class PreparedJob(Job, Generic[AnyFit]):
    """Runs ``job``, then prepares its materials; ``prepared`` has one item per material, and
    ``colours`` the values at the vertices where materials vary. with_osl: whether Blender can run
    the OSL shader."""

    def __init__(self, job: AnyFit, with_osl: bool) -> None:
        super().__init__()
        self.job, self.with_osl = job, with_osl
        self.prepared: list[Prepared] = []
        self.colours: dict[str, NDArray[np.float32]] | None = None

    @property
    def result(self) -> CaptureResult | None:
        """The result of the job."""
        return self.job.result

    def run(self) -> Iterator[Step]:
        """Yield the job's steps, then one for each material."""
        for step in self.job.run():
            yield Step(step.stage, JOB_FRACTION * step.fraction)
        materials = () if self.job.result is None else self.job.result.materials
        for material in materials:
            yield Step(PREPARING, JOB_FRACTION)
            self.prepared.append(prepare(material.fit.brdf, self.with_osl))
        if self.job.result is not None and self.job.result.varying is not None:
            yield Step(PREPARING, JOB_FRACTION)
            self.colours = at_vertices(self.job.result.varying)


SPHERE, SAMPLING, LOBES, PRINCIPLED = "sphere", "sampling", "lobes", "principled"


def material_piece(brdf: PrincipalBRDF, piece: str) -> Any:
    """What Blender shows of an edited material. SPHERE: preview and icon; SAMPLING: (tables of the
    shader, its parts that vary); LOBES and PRINCIPLED: fits of the portable forms."""
    if piece == SPHERE:
        return spheres(brdf)
    if piece == SAMPLING:
        return ShaderTables.of(brdf), split_body(brdf.evaluate)
    return (fit_lobe_stack if piece == LOBES else fit_principled)(brdf.evaluate)


class EditedMaterialJob(Job):
    """Compute pieces of an edited material; ``found`` has each, or None where it failed."""

    def __init__(self, brdf: PrincipalBRDF, pieces: list[str]) -> None:
        super().__init__()
        self.brdf, self.pieces = brdf, pieces
        self.found: dict[str, Any] = {}

    def run(self) -> Iterator[Step]:
        """One step for each piece."""
        for count, piece in enumerate(self.pieces):
            yield Step(piece, count / len(self.pieces))
            try:
                self.found[piece] = material_piece(self.brdf, piece)
            except Exception:  # extreme sliders may fail; the other pieces must still be updated
                log.exception("The %s of an edited material could not be computed.", piece)
                self.found[piece] = None
