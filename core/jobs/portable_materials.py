"""Approximations of a fitted BRDF for other renderers: Principled BSDF and a stack of lobes."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

from ..appearance.lobe_fit import LobeStackFit, fit_lobe_stack
from ..appearance.principled_fit import PrincipledFit, fit_principled
from ..basis import PrincipalBRDF
from ..concurrency.background import in_background
from ..concurrency.job import Step
from ..concurrency.thread_pool import thread_count, thread_pool


@dataclass(frozen=True)
class Portable:
    """The best approximations of a BRDF that exporters and EEVEE can use."""

    principled: PrincipledFit
    lobes: LobeStackFit


def fit_portable(
    brdf: PrincipalBRDF, name: str, start: float, threads: int | None
) -> Generator[Step, None, Portable]:
    """Fit both approximations in the background.

    name: of the material, for the progress display; start: fraction of the job that is done;
    threads: None for one per core.
    """
    step = Step(f"fitting {name} for other renderers", start)
    yield step

    def principled() -> PrincipledFit:
        return fit_principled(brdf.evaluate)

    def lobes() -> LobeStackFit:
        return fit_lobe_stack(brdf.evaluate)

    def both() -> Portable:
        with thread_pool(min(2, thread_count(threads))) as pool:
            if pool is None:
                return Portable(principled(), lobes())
            stack = pool.submit(lobes)
            return Portable(principled(), stack.result())

    return (yield from in_background(both, step))
