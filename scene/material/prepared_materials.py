"""Compute previews and shader tables of fitted materials in the background. These take seconds;
afterwards Blender blocks only while its own data is changed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from ...core.basis import PrincipalBRDF
from ...core.concurrency.background import in_background
from ...core.concurrency.job import Job, Step
from ...core.jobs import CaptureResult
from .material_nodes import osl_missing
from .osl_files import ShaderTables, shader_tables
from .preview import Picture, spheres

JOB_FRACTION = 0.96  # share of the fit in the progress of a PreparedJob


class Fitting(Protocol):
    """A job whose result is a CaptureResult."""

    result: CaptureResult | None

    def run(self) -> Iterator[Step]: ...


@dataclass(frozen=True)
class Prepared:
    """Data of one material. spheres: for preview and icon; tables: of the OSL shader, None if it
    cannot run."""

    spheres: list[Picture]
    tables: ShaderTables | None


def prepare(brdf: PrincipalBRDF, with_osl: bool) -> Prepared:
    """Compute the data of one material. Does not use Blender, so it may run in any thread."""
    _ = brdf.basis.version  # computes and caches the checksum of the components for file names
    return Prepared(spheres(brdf), shader_tables(brdf) if with_osl else None)


class PreparedJob(Job):
    """Runs ``job``, then prepares its materials; ``prepared`` has one item per material."""

    def __init__(self, job: Fitting) -> None:
        super().__init__()
        self.job = job
        self.prepared: list[Prepared] = []

    @property
    def result(self) -> CaptureResult | None:
        """The result of the job."""
        return self.job.result

    def run(self) -> Iterator[Step]:
        """Yield the job's steps, then those of the preparation of each material."""
        for step in self.job.run():
            yield Step(step.stage, JOB_FRACTION * step.fraction)
        if self.job.result is None:
            return
        with_osl, step_shown = osl_missing() is None, Step("Previews and shaders", JOB_FRACTION)
        for material in self.job.result.materials:
            brdf = material.fit.brdf
            made = yield from in_background(lambda brdf=brdf: prepare(brdf, with_osl), step_shown)
            self.prepared.append(made)
