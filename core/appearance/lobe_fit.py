"""Fit a lobe stack to a BRDF, with as few lobes and as simple as the accuracy allows.

The objective is that of the Principled fit (closeness.py). A plain stack is fitted first: one lobe
from several starts; each further lobe starts as a sharper or wider copy of an existing one and is
kept where it lowers the error by more than 5 %. From there the same is done with colours that
change towards the silhouette.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from . import lobe_model
from .closeness import FitObjective
from .cube_root import COARSE, Evaluate, Target
from .lobe_model import PLAIN_BASE, PLAIN_EACH
from .lobe_stack import MAX_LOBES, LobeStack
from .principled import MIN_ROUGHNESS

Array = NDArray[np.floating]

LOBE_GAIN = 0.95  # a further lobe must reduce the error below this fraction
TURNING_GAIN = 0.97  # the same for colours that change towards the silhouette
NEGLIGIBLE = 5e-4  # error below which no further lobe or colour is tried
FIRST = (0.08, 0.2, 0.45, 0.8)  # start values of the roughness of the first lobe
COMPANIONS = (0.4, 2.0)  # roughness of a further lobe relative to an existing one
ROUGH_STEPS, FINE_STEPS = 12, 30  # evaluations for comparing starts, and for the best


@dataclass(frozen=True)
class LobeStackFit:
    """The lobe stack closest to a BRDF.

    plain: the closest with colours that do not change towards the silhouette, for formats that do
    not support such colours (MaterialX). error, plain_error: relative cube-root error, as in
    PrincipledFit. psnr, plain_psnr: dB, of the pictures of random_light.py. errors: number of lobes
    tried → square root of the objective (closeness.py), of plain stacks.
    """

    stack: LobeStack
    error: float
    psnr: float
    plain: LobeStack
    plain_error: float
    plain_psnr: float
    errors: Mapping[int, float]


def fit_lobe_stack(evaluate: Evaluate, most: int = MAX_LOBES, turning: bool = True) -> LobeStackFit:
    """The stack of at most ``most`` lobes closest to ``evaluate(angles) -> (n, 3)``, ρ in 1/sr.

    turning: colours may change towards the silhouette.
    """
    goal = FitObjective.of(evaluate, COARSE)
    found: dict[int, Array] = {}
    starts = _first(goal.target)
    for count in range(1, most + 1):
        tried = [_descend(goal, x, ROUGH_STEPS, plain=True) for x in starts]
        best = min(tried, key=lambda x: _error(goal, x))
        found[count] = _descend(goal, best, FINE_STEPS, plain=True)
        if _error(goal, found[count]) < NEGLIGIBLE:
            break
        starts = _further(found[count])
    errors = {count: _error(goal, x) for count, x in found.items()}
    chosen = min(found)
    for count in found:
        if errors[count] < LOBE_GAIN * errors[chosen]:
            chosen = count
    plain = best = found[chosen]
    if turning and errors[chosen] > NEGLIGIBLE:
        for count in range(chosen, max(found) + 1):
            x = _descend(goal, found[count], FINE_STEPS, plain=False)
            gain = TURNING_GAIN if best is plain else LOBE_GAIN
            if _error(goal, x) < gain * _error(goal, best):
                best = x
    f, f_plain = _reflectance(goal, best), _reflectance(goal, plain)
    return LobeStackFit(
        stack=lobe_model.stack_of(best),
        error=goal.error(f),
        psnr=goal.psnr(f),
        plain=lobe_model.stack_of(plain),
        plain_error=goal.error(f_plain),
        plain_psnr=goal.psnr(f_plain),
        errors=errors,
    )


def _reflectance(goal: FitObjective, x: Array) -> Array:
    """f (n, 3) in 1/sr of the stack with unknowns x, at the directions of the objective."""
    return lobe_model.stack_of(x).at(goal.where)


def _error(goal: FitObjective, x: Array) -> float:
    """Square root of the objective of the stack with unknowns x."""
    return goal.cost(_reflectance(goal, x)) ** 0.5


def _whole(plain: Array) -> Array:
    """All unknowns of a plain stack, from its reduced ones."""
    return plain[lobe_model.tied((len(plain) - PLAIN_BASE) // PLAIN_EACH)]


def _plain(x: Array) -> Array:
    """The reduced unknowns of a plain stack, from all of them."""
    places = lobe_model.tied((len(x) - lobe_model.BASE) // lobe_model.EACH)
    part = np.zeros(places.max() + 1)
    part[places] = x
    return part


def _first(target: Target) -> list[Array]:
    """Stacks of one lobe: a dielectric of several roughnesses, and a metal of the BRDF's hue."""
    root = np.sqrt(np.clip(target.lambertian(), 0.01, 0.95))
    hue = 0.9 * root / root.max()
    edge = np.full(3, 0.7)
    glossy = [
        np.concatenate([0.9 * root, [0.1], edge, np.full(3, 0.25), [roughness]])
        for roughness in FIRST
    ]
    metals = [
        np.concatenate([0.2 * root, [0.1], 0.95 + 0 * edge, hue, [roughness]])
        for roughness in FIRST[:3]
    ]
    return [_whole(plain) for plain in glossy + metals]


def _further(x: Array) -> list[Array]:
    """Stacks with one lobe more: a lobe is split into two of different roughness that share its
    reflectance."""
    plain, starts = _plain(x), []
    for k in range((len(plain) - PLAIN_BASE) // PLAIN_EACH):
        place = slice(PLAIN_BASE + PLAIN_EACH * k, PLAIN_BASE + PLAIN_EACH * (k + 1))
        for wider in COMPANIONS:
            old, new = plain[place].copy(), plain[place].copy()
            new[6] = np.clip(wider * old[6], MIN_ROUGHNESS, 0.95)
            if abs(np.log(new[6] / old[6])) < 0.2:
                continue
            old[3:6] *= 0.85
            new[3:6] = np.maximum(0.5 * new[3:6], 0.1)
            new[:3] = np.maximum(0.8 * new[:3], 0.3)
            pair = [new, old] if wider < 1 else [old, new]
            starts.append(
                _whole(np.concatenate([plain[: place.start], *pair, plain[place.stop :]]))
            )
    return starts


def _descend(goal: FitObjective, start: Array, most_steps: int, plain: bool) -> Array:
    """Least squares from a start; plain: over the reduced unknowns of a plain stack."""
    lobes = (len(start) - lobe_model.BASE) // lobe_model.EACH
    low, high = lobe_model.bounds(lobes)
    places = lobe_model.tied(lobes) if plain else np.arange(len(start))
    first = np.unique(places, return_index=True)[1]
    ties = (places == np.arange(len(first))[:, None]).astype(float)
    seen: dict[bytes, tuple[Array, Array]] = {}

    def both(part: Array) -> tuple[Array, Array]:
        key = part.tobytes()
        if key not in seen:
            seen.clear()
            f, slopes = lobe_model.reflectance_and_derivatives(part[places], goal.where)
            if plain:
                slopes = np.tensordot(ties, slopes, axes=1)
            seen[key] = goal.residual_and_slopes(f, slopes)
        return seen[key]

    result = least_squares(
        lambda part: both(part)[0],
        np.clip(start, low + 2e-2, high - 2e-2)[first],
        jac=lambda part: both(part)[1],
        bounds=(low[first], high[first]),
        xtol=1e-5,
        ftol=1e-5,
        max_nfev=most_steps,
    )
    return np.asarray(result.x[places])
