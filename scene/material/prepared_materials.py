"""What a fit's materials need that takes seconds to work out, made beside the job: Blender stands
still only for what has to be done to its own data."""

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

SHARE = 0.98  # of the whole, before this


class Fitting(Protocol):
    """A job that ends with a CaptureResult."""

    result: CaptureResult | None

    def run(self) -> Iterator[Step]: ...


@dataclass(frozen=True)
class Prepared:
    """spheres: of the preview and the icon; tables: of the OSL shader, None where it cannot run."""

    spheres: list[Picture]
    tables: ShaderTables | None


def prepare(brdf: PrincipalBRDF, with_osl: bool) -> Prepared:
    """Knows nothing of Blender: other threads may ask."""
    _ = brdf.basis.version  # a sum over the components, which file names need: kept once it is made
    return Prepared(spheres(brdf), shader_tables(brdf) if with_osl else None)


class PreparedJob(Job):
    """``job`` and what its materials need; ``prepared``: one a material of its result."""

    def __init__(self, job: Fitting) -> None:
        super().__init__()
        self.job = job
        self.prepared: list[Prepared] = []

    @property
    def result(self) -> CaptureResult | None:
        """Of the job."""
        return self.job.result

    def run(self) -> Iterator[Step]:
        """The job's steps, then a material at a time."""
        for step in self.job.run():
            yield Step(step.stage, SHARE * step.fraction)
        if self.job.result is None:
            return
        with_osl, said = osl_missing() is None, Step("previews and shaders", SHARE)
        for material in self.job.result.materials:
            brdf = material.fit.brdf
            made = yield from in_background(lambda brdf=brdf: prepare(brdf, with_osl), said)
            self.prepared.append(made)
