"""Fit the Principled BSDF to a BRDF: near in pictures, and in the cube root (closeness.py)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from .closeness import Closeness
from .cube_root import COARSE, NODES, Evaluate
from .layer_albedo import ior_from_f0
from .principled import MIN_ROUGHNESS, Principled

Array = NDArray[np.floating]

SIMPLER = 1.05  # a pure dielectric or metal may be this much farther off than a mixture
METALLIC, PINNED = 3, 1e-3
COAT_GAIN = 0.97  # a coat must bring the error below this fraction of what goes without it
COAT_FROM = 0.003  # and is not worth having where it is smaller than this already
TINT_GAIN = 0.97  # a specular tint must bring it below this fraction of what goes without
F0_OF_GLASS = 0.04  # reflectance at normal incidence of IOR 1.5
MOST_BY_LEVEL = 2 * F0_OF_GLASS  # the most that the specular level makes of it

# unknowns: base colour (as its square root: even steps in what the eye sees), metallic, roughness,
# reflectance at normal incidence (square root), diffuse roughness, specular tint, coat weight,
# coat roughness
LOWER = np.array([0, 0, 0, 0, MIN_ROUGHNESS, 0, 0, 0, 0, 0, 0, MIN_ROUGHNESS])
UPPER = np.array([1, 1, 1, 1, 1, 0.7, 1, 1, 1, 1, 1, 1.0])
COAT = 10
PLAIN, TINTED, COAT_TOO = tuple(range(7)), tuple(range(10)), (COAT, COAT + 1)


@dataclass(frozen=True)
class PrincipledFit:
    """The Principled nearest to a BRDF, and how near that is.

    error: relative cube-root error, ‖∛(f cosθi) − ∛(ρ cosθi)‖ / ‖∛(ρ cosθi)‖.
    diffuse_error: the same of the best Lambertian, to compare with; lambertian: its albedo (3,).
    errors: what was made small (closeness.py), of each start: 'diffuse', 'glossy', 'metal',
        'mirror' (those that lost on a coarser quadrature), 'coated' where it was tried.
    start: the one that won.
    clipped: True where the BRDF asks for a base colour above 1 and did not get it.
    psnr: dB, in the pictures of random_light.py.
    """

    principled: Principled
    error: float
    diffuse_error: float
    errors: Mapping[str, float]
    start: str
    clipped: bool
    psnr: float = math.nan
    lambertian: Array = field(default_factory=lambda: np.full(3, math.nan))


def fit_principled(
    evaluate: Evaluate, coat: bool = True, nodes: tuple[int, int, int] = NODES
) -> PrincipledFit:
    """The Principled nearest to ``evaluate(angles) -> (n, 3)``, ρ in 1/sr.

    coat: allow a second lobe where it lowers the error by some percent. A pure dielectric or a
    pure metal is taken where it comes nearly as near as a mixture: no surface is half a metal.
    """
    goal, coarse = Closeness.of(evaluate, nodes), Closeness.of(evaluate, COARSE)

    def cost(x: Array) -> float:
        return goal.cost(_principled(x).at(goal.where)) ** 0.5

    mean = goal.target.lambertian()
    root = np.sqrt(np.clip(mean, 0.02, 0.95))
    peak = np.sqrt(np.clip(mean / max(mean.max(), 1e-6), 0.02, 0.95))  # a metal: hue alone
    rest = [0.1, 1.0, 1.0, 1.0, 0.0, 0.2]
    starts = {
        "diffuse": [*root, 0.02, 0.7, 0.15, *rest],
        "glossy": [*root, 0.02, 0.25, 0.2, *rest],
        "metal": [*peak, 0.9, 0.3, 0.2, *rest],
        "mirror": [*peak, 0.5, 0.08, 0.2, *rest],
    }
    found = {name: _descend(coarse, np.array(x), PLAIN) for name, x in starts.items()}
    best = min(found, key=lambda name: cost(found[name]))
    mixed = _descend(goal, found[best], PLAIN)
    tinted = _descend(goal, mixed, TINTED)
    if cost(tinted) < TINT_GAIN * cost(mixed):
        mixed, free = tinted, TINTED
    else:
        free = PLAIN
    found[best] = _purest(goal, mixed, free)
    if coat and cost(found[best]) > COAT_FROM:
        start = mixed.copy()
        start[COAT:] = 0.5, np.clip(0.4 * start[4], 0.05, 0.6)
        found["coated"] = _purest(goal, _descend(goal, start, free + COAT_TOO), free + COAT_TOO)
    costs = {name: cost(x) for name, x in found.items()}
    if "coated" in costs and costs["coated"] < COAT_GAIN * costs[best]:
        best = "coated"
    f = _principled(found[best]).at(goal.where)
    flat = Principled(base_color=np.clip(mean, 0, 1), specular_ior_level=0.0, roughness=1.0)
    return PrincipledFit(
        principled=_principled(found[best]),
        error=goal.error(f),
        diffuse_error=goal.error(flat.at(goal.where)),
        errors=costs,
        start=best,
        clipped=bool(np.any(found[best][:3] > 0.999)),
        psnr=goal.psnr(f),
        lambertian=flat.base_color,
    )


def _principled(x: Array) -> Principled:
    f0 = float(x[5]) ** 2
    return Principled(
        base_color=np.clip(x[:3] ** 2, 0, 1),
        metallic=float(x[METALLIC]),
        roughness=float(x[4]),
        ior=1.5 if f0 <= MOST_BY_LEVEL else ior_from_f0(f0),
        specular_ior_level=0.5 * f0 / F0_OF_GLASS if f0 <= MOST_BY_LEVEL else 0.5,
        specular_tint=np.array(x[7:10]),
        coat_weight=float(x[COAT]),
        coat_roughness=float(x[COAT + 1]),
        diffuse_roughness=float(x[6]),
    )


def _descend(
    goal: Closeness, start: Array, free: Sequence[int], metallic: float | None = None
) -> Array:
    """Least squares over the ``free`` unknowns; the others stay as they start, and so does
    metallic where it is given."""
    places = list(free)
    low, high = LOWER.copy(), UPPER.copy()
    if metallic is not None:
        low[METALLIC] = max(metallic - PINNED, 0.0)
        high[METALLIC] = min(metallic + PINNED, 1.0)

    def whole(part: Array) -> Array:
        x = start.copy()
        x[places] = part
        return x

    def residual(part: Array) -> Array:
        return goal.residual(_principled(whole(part)).at(goal.where))

    margin = np.minimum(1e-3, 0.25 * (high - low))
    result = least_squares(
        residual,
        np.clip(start, low + margin, high - margin)[places],
        bounds=(low[places], high[places]),
        diff_step=1e-4,
        xtol=1e-5,
        ftol=1e-6,
        max_nfev=40,
    )
    settled = _settle(whole(result.x))
    if metallic is not None:
        settled[METALLIC] = metallic
    return settled


def _purest(goal: Closeness, mixed: Array, free: Sequence[int]) -> Array:
    """The pure dielectric or metal that is nearly as near as the mixture, else the mixture."""

    def cost(x: Array) -> float:
        return goal.cost(_principled(x).at(goal.where)) ** 0.5

    within = SIMPLER * cost(mixed) + 1e-4
    for pure in (0.0, 1.0):
        x = _descend(goal, mixed, free, metallic=pure)
        if cost(x) < within:
            return x
    return mixed


def _settle(x: Array) -> Array:
    """Numbers a hair from 0 become 0: an artist reads 'metallic 0', not 0.0004."""
    settled = x.copy()
    for i in (METALLIC, 6, COAT):
        if x[i] < 2e-3:
            settled[i] = 0.0
    if x[5] ** 2 < 2e-4:
        settled[5] = 0.0
    return settled
