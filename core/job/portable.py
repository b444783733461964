"""A measured material as other renderers show it: Principled, and a stack of lobes."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

from ..appearance.lobe_fit import LobeStackFit, fit_lobe_stack
from ..appearance.principled_fit import PrincipledFit, fit_principled
from ..basis import PrincipalBRDF
from .beside import beside
from .job import Step


@dataclass(frozen=True)
class Portable:
    """What is nearest to a BRDF of what exporters and EEVEE know."""

    principled: PrincipledFit
    lobes: LobeStackFit


def fit_portable(
    brdf: PrincipalBRDF, name: str, start: float, share: float
) -> Generator[Step, None, Portable]:
    """Of a material of that name; takes the part ``share`` of the job from ``start`` on."""
    step = Step(f"Principled material of {name}", start)
    yield step
    principled = yield from beside(lambda: fit_principled(brdf.evaluate), step)
    step = Step(f"lobe stack of {name}", start + 0.5 * share)
    yield step
    lobes = yield from beside(lambda: fit_lobe_stack(brdf.evaluate), step)
    return Portable(principled, lobes)
