"""Fit the Principled BSDF to a BRDF, by rendered pictures and the cube-root metric
(closeness.py)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from .closeness import FitObjective
from .cube_root import COARSE, NODES, Evaluate
from .layer_albedo import F0_OF_GLASS, ior_from_f0
from .principled import MIN_ROUGHNESS, Principled

Array = NDArray[np.floating]

PURE_TOLERANCE = 1.05  # allowed error of a pure dielectric or metal relative to a mixture
METALLIC, PINNED = 3, 1e-3  # index of the unknown; half the interval when it is fixed
COAT_GAIN = 0.97  # a coat must reduce the error below this fraction of that without
COAT_FROM = 0.003  # no coat is tried where the error is smaller
TINT_GAIN = 0.97  # a specular tint must reduce the error below this fraction of that without
MAX_F0_BY_LEVEL = 2 * F0_OF_GLASS  # largest reflectance that the specular level can set

# unknowns: base colour (square root: perceptually even steps), metallic, roughness,
# reflectance at normal incidence (square root), diffuse roughness, specular tint, coat weight,
# coat roughness
LOWER = np.array([0, 0, 0, 0, MIN_ROUGHNESS, 0, 0, 0, 0, 0, 0, MIN_ROUGHNESS])
UPPER = np.array([1, 1, 1, 1, 1, 0.7, 1, 1, 1, 1, 1, 1.0])
COAT = 10  # index of the first unknown of the coat
PLAIN, TINTED, COAT_TOO = tuple(range(7)), tuple(range(10)), (COAT, COAT + 1)


@dataclass(frozen=True)
class PrincipledFit:
    """The Principled BSDF closest to a BRDF, and its errors.

    error: relative cube-root error, ‖∛(f cosθi) − ∛(ρ cosθi)‖ / ‖∛(ρ cosθi)‖.
    diffuse_error: the same for the best Lambertian surface, as a reference; lambertian: its albedo
    (3,).
    errors: start → square root of the objective (closeness.py): 'diffuse', 'glossy', 'metal',
    'mirror' (those that lost, on a coarser quadrature), and 'coated' where it was tried.
    start: the one that was chosen.
    clipped: True where a base colour above 1 would fit better.
    psnr: dB, of the pictures of random_light.py.
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
    """The Principled BSDF closest to ``evaluate(angles) -> (n, 3)``, ρ in 1/sr.

    coat: allow a second lobe where it lowers the error by some percent. A pure dielectric or a pure
    metal is preferred where it fits nearly as well as a mixture: no real surface is half a metal.
    Raises FitError where evaluate returns another shape or values that are not finite.
    """
    goal, coarse = FitObjective.of(evaluate, nodes), FitObjective.of(evaluate, COARSE)

    def cost(x: Array) -> float:
        return goal.cost(_principled(x).at(goal.where)) ** 0.5

    mean = goal.target.lambertian()
    root = np.sqrt(np.clip(mean, 0.02, 0.95))
    peak = np.sqrt(np.clip(mean / max(mean.max(), 1e-6), 0.02, 0.95))  # of a metal: only the hue
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
    """The Principled BSDF with these unknowns."""
    f0 = float(x[5]) ** 2
    return Principled(
        base_color=np.clip(x[:3] ** 2, 0, 1),
        metallic=float(x[METALLIC]),
        roughness=float(x[4]),
        ior=1.5 if f0 <= MAX_F0_BY_LEVEL else ior_from_f0(f0),
        specular_ior_level=0.5 * f0 / F0_OF_GLASS if f0 <= MAX_F0_BY_LEVEL else 0.5,
        specular_tint=np.array(x[7:10]),
        coat_weight=float(x[COAT]),
        coat_roughness=float(x[COAT + 1]),
        diffuse_roughness=float(x[6]),
    )


def _descend(
    goal: FitObjective, start: Array, free: Sequence[int], metallic: float | None = None
) -> Array:
    """Least squares over the ``free`` unknowns; the others stay at their start values, and so does
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
    settled = _zero_negligible(whole(result.x))
    if metallic is not None:
        settled[METALLIC] = metallic
    return settled


def _purest(goal: FitObjective, mixed: Array, free: Sequence[int]) -> Array:
    """The pure dielectric or metal that fits nearly as well as the mixture, else the mixture."""

    def cost(x: Array) -> float:
        return goal.cost(_principled(x).at(goal.where)) ** 0.5

    within = PURE_TOLERANCE * cost(mixed) + 1e-4
    for pure in (0.0, 1.0):
        x = _descend(goal, mixed, free, metallic=pure)
        if cost(x) < within:
            return x
    return mixed


def _zero_negligible(x: Array) -> Array:
    """Set negligible values to 0, so that a user sees 'metallic 0' and not 0.0004."""
    settled = x.copy()
    for i in (METALLIC, 6, COAT):
        if x[i] < 2e-3:
            settled[i] = 0.0
    if x[5] ** 2 < 2e-4:
        settled[5] = 0.0
    return settled
