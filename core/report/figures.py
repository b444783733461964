"""What the report says of a material in figures, each with what it means."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..fit import PaperFit
from ..fit.held_out import HeldOut
from ..fit.measured_result import NINETY, MeasuredResult
from ..fit.spread import Spread
from ..jobs import MaterialResult

GAIN_WORTH_TELLING = 0.02
PERCENT = 0.5  # half widths beyond are told as factors


def figures(material: MaterialResult, photos: Sequence[str]) -> list[tuple[str, str]]:
    """(name, sentence) of every figure; photos: their names."""
    if isinstance(material.fit, MeasuredResult):
        own = _measured(material.fit, material, photos)
    else:
        own = _paper(material.fit, material)
    p = material.principled.principled
    colour = ", ".join(f"{c:.3f}" for c in p.base_color)
    return [
        ("held-out photos", _unseen(material.held_out)),
        *own,
        (
            "Principled",
            f"base colour {colour} · metallic {p.metallic:.2f} · roughness {p.roughness:.2f} · "
            f"specular {p.specular_ior_level:.2f} · coat {p.coat_weight:.2f} "
            f"(cube-root error {100 * material.principled.error:.1f} %)",
        ),
    ]


def told_gains(fit: MeasuredResult) -> dict[int, float]:
    """Photo → gain, of those that differ enough to be told."""
    return fit.odd_gains(GAIN_WORTH_TELLING)


def half_width(deviation: float) -> float:
    """What a 90 % interval reaches to either side, as a fraction."""
    return float(np.expm1(NINETY * deviation))


def _unseen(held: HeldOut | None) -> str:
    if held is None:
        return "nothing could be held out: too few photos see it, or it was switched off"
    return (
        f"predicts the typical pixel of an unseen photo to {100 * held.typical:.0f} %; "
        f"{100 * held.error:.0f} % relative RMS, which highlights dominate"
    )


def _measured(
    fit: MeasuredResult, material: MaterialResult, photos: Sequence[str]
) -> list[tuple[str, str]]:
    gains = told_gains(fit)
    odd = " · ".join(f"{photos[p]} {100 * (g - 1):+.0f} %" for p, g in sorted(gains.items()))
    return [
        ("samples", _samples(material)),
        (
            "scan's normals",
            f"off by about {fit.normal_deviation:.1f}° (along each tangent), as the photos say",
        ),
        (
            "photos against each other",
            f"brighter or darker than the fit says: {odd}"
            if odd
            else f"agree to {100 * GAIN_WORTH_TELLING:.0f} %",
        ),
        ("unseen directions", fit.anchoring),
        (
            "90 % interval",
            f"{reach(material.spread)}: nine times in ten the truth is not farther off",
        ),
    ]


def reach(spread: Spread) -> str:
    """A measured fit's uncertainty in a phrase."""
    median, wide, peak = (
        either_side(d) for d in (spread.median, spread.percentile_90, spread.at_highlight)
    )
    return f"{median} in half of all directions, {wide} in most, {peak} at the highlight"


def either_side(deviation: float) -> str:
    """A 90 % interval in words; a wide one reaches as far down by division as up."""
    wide = half_width(deviation)
    return f"± {100 * wide:.0f} %" if wide < PERCENT else f"a factor of {1 + wide:.1f} either way"


def _samples(material: MaterialResult) -> str:
    if material.used >= material.samples:
        return f"{material.samples:,} lit pixels, every one of them used"
    return (
        f"{material.samples:,} lit pixels: {material.used:,} of them, which stand for the others "
        "of their photo"
    )


def _paper(fit: PaperFit, material: MaterialResult) -> list[tuple[str, str]]:
    spread = material.spread
    return [
        (
            "samples",
            f"{material.samples:,} lit pixels, {fit.reliable:,} on calm surface, "
            f"{len(fit.chosen)} chosen (condition number {fit.condition:.1f})",
        ),
        (
            "cosine similarity",
            f"{fit.similarity.max():.4f}, the best of {len(fit.similarity)} trials "
            f"(worst {fit.similarity.min():.4f})",
        ),
        (
            "spread of trials",
            f"± {100 * spread.median:.0f} % median, "
            f"± {100 * spread.at_highlight:.0f} % at the highlight",
        ),
    ]
