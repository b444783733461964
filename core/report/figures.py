"""The table of the report: the figures of one material, each as a sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..appearance.energy import directional_albedo
from ..fit import PaperFit
from ..fit.measured_result import NINETY_PERCENT, MeasuredResult
from ..fit.spread import Spread
from ..jobs import MaterialResult

MIN_REPORTED_GAIN = 0.02  # relative: smaller exposure differences of a photo are not reported
MAX_PERCENT = 0.5  # relative half width of an interval: a wider one is given as a factor


def figures(material: MaterialResult, photos: Sequence[str]) -> list[tuple[str, str]]:
    """(heading, sentence) of each row of a material's table; photos: the photos' names."""
    if isinstance(material.fit, MeasuredResult):
        own = _measured(material.fit, material, photos)
    else:
        own = _paper(material.fit, material)
    p = material.principled.principled
    colour = ", ".join(f"{c:.3f}" for c in p.base_color)
    return [
        ("Held-out photos", _held_out(material)),
        *own,
        ("Reflected light", _reflected(material)),
        (
            "Principled",
            f"Base colour {colour} · metallic {p.metallic:.2f} · roughness {p.roughness:.2f} · "
            f"specular {p.specular_ior_level:.2f} · coat {p.coat_weight:.2f} "
            f"(cube-root error {100 * material.principled.error:.1f} %).",
        ),
    ]


def notable_gains(fit: MeasuredResult) -> dict[int, float]:
    """Photo → gain, for the photos whose gain differs from 1 by more than MIN_REPORTED_GAIN."""
    return fit.gains_beyond(MIN_REPORTED_GAIN)


def half_width(deviation: float) -> float:
    """Upper half width of the 90 % interval as a fraction of ρ; deviation: the standard deviation
    of the logarithm of ρ."""
    return float(np.expm1(NINETY_PERCENT * deviation))


def _reflected(material: MaterialResult) -> str:
    """The albedo at normal incidence: an error of the lights' irradiance shows in it."""
    if not material.irradiance_known:
        return "Unknown, as is the irradiance of the lights."
    red, green, blue = 100 * directional_albedo(material.fit.brdf.evaluate, np.zeros(1))[0]
    return (
        f"With the irradiance of the capture, the material reflects {red:.2g} % of red, "
        f"{green:.2g} % of green and {blue:.2g} % of blue light that comes along the normal."
    )


def _held_out(material: MaterialResult) -> str:
    held = material.held_out
    if held is None:
        return "Not tested: too few photos show the material, or the test was switched off."
    return (
        f"{material.quality.sentence}. Each photo is predicted from the others; relative RMS error "
        f"{100 * held.error:.0f} % (dominated by highlights)."
    )


def _measured(
    fit: MeasuredResult, material: MaterialResult, photos: Sequence[str]
) -> list[tuple[str, str]]:
    gains = notable_gains(fit)
    odd = " · ".join(f"{photos[p]} {100 * (g - 1):+.0f} %" for p, g in sorted(gains.items()))
    return [
        ("Samples", _samples(material)),
        (
            "Normals of the scan",
            f"Estimated standard deviation: {fit.normal_deviation:.1f}° along each tangent.",
        ),
        (
            "Brightness of the photos",
            f"Brighter or darker than the fit predicts: {odd}."
            if odd
            else f"All photos agree with the fit to {100 * MIN_REPORTED_GAIN:.0f} %.",
        ),
        ("Directions without samples", fit.extrapolation),
        (
            "90 % interval",
            f"The interval is {reach(material.spread)}. The true BRDF is within it in nine of ten "
            "cases.",
        ),
    ]


def reach(spread: Spread) -> str:
    """The 90 % interval of a measured fit as a phrase: median, 90th percentile, highlight."""
    median, wide, peak = (
        either_side(d) for d in (spread.median, spread.percentile_90, spread.at_highlight)
    )
    return f"{median} in half of all directions, {wide} in 90 % of them, {peak} at the highlight"


def either_side(deviation: float) -> str:
    """A 90 % interval in words: a percentage, or a factor (up or down) if it is wide."""
    wide = half_width(deviation)
    return (
        f"± {100 * wide:.0f} %" if wide < MAX_PERCENT else f"a factor of {1 + wide:.1f} either way"
    )


def _samples(material: MaterialResult) -> str:
    if material.used >= material.samples:
        return f"{material.samples:,} lit pixels, all of them used."
    return (
        f"{material.samples:,} lit pixels; {material.used:,} of them "
        f"({100 * material.used / material.samples:.3g} %) are used, a selection from each photo."
    )


def _paper(fit: PaperFit, material: MaterialResult) -> list[tuple[str, str]]:
    spread = material.spread
    return [
        (
            "Samples",
            f"{material.samples:,} lit pixels, {fit.reliable:,} of low curvature, "
            f"{len(fit.chosen)} selected (condition number {fit.condition:.1f}).",
        ),
        (
            "Cosine similarity",
            f"{fit.similarity.max():.4f}, the best of {len(fit.similarity)} trials "
            f"(worst {fit.similarity.min():.4f}).",
        ),
        (
            "Standard deviation between trials",
            f"± {100 * spread.median:.0f} % (median), "
            f"± {100 * spread.at_highlight:.0f} % at the highlight.",
        ),
    ]
