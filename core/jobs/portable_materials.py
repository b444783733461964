"""A measured material as other renderers show it: Principled, and a stack of lobes."""

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
    """What is nearest to a BRDF of what exporters and EEVEE know."""

    principled: PrincipledFit
    lobes: LobeStackFit


def fit_portable(
    brdf: PrincipalBRDF, name: str, start: float, threads: int | None
) -> Generator[Step, None, Portable]:
    """Of a material of that name, ``start`` of the job done; threads: None: one a core."""
    step = Step(f"{name} in other renderers", start)
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
