"""Fit the inputs of the Principled BSDF to a BRDF, by rendered pictures and the cube-root metric
(closeness.py), as Blender or another format computes them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from .closeness import FitObjective
from .cube_root import COARSE, NODES, Evaluate
from .layer_albedo import F0_OF_GLASS, ior_from_f0
from .layered_model import Configuration
from .principled import MIN_ROUGHNESS, Principled

Array = NDArray[np.floating]

PURE_TOLERANCE = 1.05  # allowed error of a pure dielectric or metal relative to a mixture
METALLIC, PINNED = 3, 1e-3  # index of the unknown; half the interval when it is fixed
DIFFUSE_ROUGHNESS = 6  # index of the unknown
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
PLAIN, TINT, COAT_TOO = tuple(range(7)), (7, 8, 9), (COAT, COAT + 1)


@dataclass(frozen=True)
class Interpretation:
    """How a program or a format computes the inputs of the Principled BSDF.

    at: f (n, 3) in 1/sr of the inputs at configurations. diffuse_roughness, specular_tint: whether
    it has these inputs; without, the fit keeps their defaults. specular_level: whether the specular
    level changes the reflectance at normal incidence; if not, the fit changes the IOR only.
    """

    at: Callable[[Principled, Configuration], Array]
    diffuse_roughness: bool = True
    specular_tint: bool = True
    specular_level: bool = True

    def of(self, x: Array, where: Configuration) -> Array:
        """f (n, 3) in 1/sr of the inputs with unknowns x."""
        return self.at(self.principled(x), where)

    def principled(self, x: Array) -> Principled:
        """The inputs with unknowns x."""
        f0 = float(x[5]) ** 2
        by_level = self.specular_level and f0 <= MAX_F0_BY_LEVEL
        return Principled(
            base_color=np.clip(x[:3] ** 2, 0, 1),
            metallic=float(x[METALLIC]),
            roughness=float(x[4]),
            ior=1.5 if by_level else ior_from_f0(f0),
            specular_ior_level=0.5 * f0 / F0_OF_GLASS if by_level else 0.5,
            specular_tint=np.array(x[7:10]),
            coat_weight=float(x[COAT]),
            coat_roughness=float(x[COAT + 1]),
            diffuse_roughness=float(x[DIFFUSE_ROUGHNESS]),
        )


BLENDER = Interpretation(Principled.at)


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
    evaluate: Evaluate,
    coat: bool = True,
    nodes: tuple[int, int, int] = NODES,
    shown: Interpretation = BLENDER,
) -> PrincipledFit:
    """The inputs of the Principled BSDF closest to ``evaluate(angles) -> (n, 3)``, ρ in 1/sr.

    coat: allow a second lobe where it lowers the error by some percent. shown: how the inputs are
    computed; the errors are those of this computation. A pure dielectric or a pure
    metal is preferred where it fits nearly as well as a mixture: no real surface is half a metal.
    Raises FitError where evaluate returns another shape or values that are not finite.
    """
    goal, coarse = FitObjective.of(evaluate, nodes), FitObjective.of(evaluate, COARSE)

    def cost(x: Array) -> float:
        return goal.cost(shown.of(x, goal.where)) ** 0.5

    plain = tuple(i for i in PLAIN if shown.diffuse_roughness or i != DIFFUSE_ROUGHNESS)
    mean = goal.target.lambertian()
    root = np.sqrt(np.clip(mean, 0.02, 0.95))
    peak = np.sqrt(np.clip(mean / max(mean.max(), 1e-6), 0.02, 0.95))  # of a metal: only the hue
    rest = [0.1 if shown.diffuse_roughness else 0.0, 1.0, 1.0, 1.0, 0.0, 0.2]
    starts = {
        "diffuse": [*root, 0.02, 0.7, 0.15, *rest],
        "glossy": [*root, 0.02, 0.25, 0.2, *rest],
        "metal": [*peak, 0.9, 0.3, 0.2, *rest],
        "mirror": [*peak, 0.5, 0.08, 0.2, *rest],
    }
    found = {name: _descend(coarse, shown, np.array(x), plain) for name, x in starts.items()}
    best = min(found, key=lambda name: cost(found[name]))
    mixed, free = _descend(goal, shown, found[best], plain), plain
    if shown.specular_tint:
        tinted = _descend(goal, shown, mixed, plain + TINT)
        if cost(tinted) < TINT_GAIN * cost(mixed):
            mixed, free = tinted, plain + TINT
    found[best] = _purest(goal, shown, mixed, free)
    if coat and cost(found[best]) > COAT_FROM:
        start = mixed.copy()
        start[COAT:] = 0.5, np.clip(0.4 * start[4], 0.05, 0.6)
        coated = _descend(goal, shown, start, free + COAT_TOO)
        found["coated"] = _purest(goal, shown, coated, free + COAT_TOO)
    costs = {name: cost(x) for name, x in found.items()}
    if "coated" in costs and costs["coated"] < COAT_GAIN * costs[best]:
        best = "coated"
    f = shown.of(found[best], goal.where)
    flat = Principled(base_color=np.clip(mean, 0, 1), specular_ior_level=0.0, roughness=1.0)
    return PrincipledFit(
        principled=shown.principled(found[best]),
        error=goal.error(f),
        diffuse_error=goal.error(flat.at(goal.where)),
        errors=costs,
        start=best,
        clipped=bool(np.any(found[best][:3] > 0.999)),
        psnr=goal.psnr(f),
        lambertian=flat.base_color,
    )


def _descend(
    goal: FitObjective,
    shown: Interpretation,
    start: Array,
    free: Sequence[int],
    metallic: float | None = None,
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
        return goal.residual(shown.of(whole(part), goal.where))

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


def _purest(goal: FitObjective, shown: Interpretation, mixed: Array, free: Sequence[int]) -> Array:
    """The pure dielectric or metal that fits nearly as well as the mixture, else the mixture."""

    def cost(x: Array) -> float:
        return goal.cost(shown.of(x, goal.where)) ** 0.5

    within = PURE_TOLERANCE * cost(mixed) + 1e-4
    for pure in (0.0, 1.0):
        x = _descend(goal, shown, mixed, free, metallic=pure)
        if cost(x) < within:
            return x
    return mixed


def _zero_negligible(x: Array) -> Array:
    """Set negligible values to 0, so that a user sees 'metallic 0' and not 0.0004."""
    settled = x.copy()
    for i in (METALLIC, DIFFUSE_ROUGHNESS, COAT):
        if x[i] < 2e-3:
            settled[i] = 0.0
    if x[5] ** 2 < 2e-4:
        settled[5] = 0.0
    return settled
