"""Fit OpenPBR to a BRDF, with the objective of the Principled fit (closeness.py).

The fit starts from the Principled BSDF's values, then lets a coat and a fuzz with their own colours
and indices of refraction join where they reduce the error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..closeness import FitObjective
from ..cube_root import Evaluate
from ..layer_albedo import F0_OF_GLASS, f0_from_ior, ior_from_f0
from ..principled import MIN_ROUGHNESS, Principled
from ..sheen import MIN_SHEEN_ROUGHNESS
from .model import OpenPBR

Array = NDArray[np.floating]

LAYER_GAIN = 0.97  # a coat or a fuzz must reduce the error below this fraction of that without
PURE_TOLERANCE = 1.05  # allowed error of a pure dielectric or metal relative to a mixture
MAX_EVALUATIONS = 40  # of a descent
PULL = 1e-3  # weight of the distance from the start: inputs that change nothing stay where they are
NEGLIGIBLE_WEIGHT = 2e-3  # weights below are set to 0
GLASS = 1.5  # index of refraction that is kept where the specular weight can set the reflectance

# unknowns: base colour (square root: perceptually even steps), metalness, roughness, reflectance of
# specular_ior at normal incidence (square root), diffuse roughness, specular colour; coat: weight,
# roughness, reflectance (square root), colour (square root); fuzz: weight, roughness, colour
# (square root)
BASE, COAT, FUZZ = slice(0, 10), slice(10, 16), slice(16, 21)
METALNESS, ROUGHNESS, F0_ROOT, DIFFUSE_ROUGHNESS = 3, 4, 5, 6
LOWER, UPPER = np.zeros(FUZZ.stop), np.ones(FUZZ.stop)
LOWER[[ROUGHNESS, COAT.start + 1]] = MIN_ROUGHNESS
LOWER[FUZZ.start + 1] = MIN_SHEEN_ROUGHNESS
LOWER[FUZZ.start + 2 :] = 0.5  # no fuzz that only absorbs light
UPPER[F0_ROOT] = 0.8  # IOR 9
LOWER[COAT.start + 2], UPPER[COAT.start + 2] = 0.05, 0.7  # IOR of the coat 1.1 to 5.7


@dataclass(frozen=True)
class OpenPBRFit:
    """The OpenPBR surface closest to a BRDF. error: relative cube-root error, as in PrincipledFit;
    psnr: dB, of the pictures of random_light.py."""

    surface: OpenPBR
    error: float
    psnr: float


def fit_open_pbr(evaluate: Evaluate, start: Principled) -> OpenPBRFit:
    """The surface closest to ``evaluate(angles) -> (n, 3)``, ρ in 1/sr, from a fitted Principled
    BSDF. Raises FitError where evaluate returns another shape or values that are not finite."""
    goal = FitObjective.of(evaluate)
    first = _unknowns(start)
    free = [*_places(BASE), *(_places(COAT) if start.coat_weight > 0 else ())]
    best = _purest(goal, _descend(goal, first, free), free)
    for layer in (FUZZ,) if start.coat_weight > 0 else (COAT, FUZZ):
        with_layer = [*free, *_places(layer)]
        more = _purest(goal, _descend(goal, _with_layer(best, layer), with_layer), with_layer)
        if _error(goal, more) < LAYER_GAIN * _error(goal, best):
            best, free = more, with_layer
    surface = _surface(best)
    f = surface.at(goal.where)
    return OpenPBRFit(surface, goal.error(f), goal.psnr(f))


def from_principled(principled: Principled) -> OpenPBR:
    """The Principled BSDF's values as inputs of OpenPBR, as Blender's exporter maps them."""
    return OpenPBR(
        base_color=np.clip(principled.base_color, 0, 1),
        base_diffuse_roughness=principled.diffuse_roughness,
        base_metalness=principled.metallic,
        specular_weight=2.0 * principled.specular_ior_level,
        specular_color=np.asarray(principled.specular_tint, float),
        specular_roughness=principled.roughness,
        specular_ior=principled.ior,
        coat_weight=principled.coat_weight,
        coat_color=np.asarray(principled.coat_tint, float),
        coat_roughness=principled.coat_roughness,
        coat_ior=principled.coat_ior,
        coat_darkening=0.0,  # Blender's coat does not darken the layers below
    )


def _unknowns(principled: Principled) -> Array:
    """Start values from a Principled BSDF."""
    f0 = principled.dielectric_f0
    x = np.zeros(FUZZ.stop)
    x[:3] = np.sqrt(np.clip(principled.base_color, 0, 1))
    x[METALNESS], x[ROUGHNESS] = principled.metallic, principled.roughness
    x[F0_ROOT] = np.sqrt(f0)
    x[DIFFUSE_ROUGHNESS] = principled.diffuse_roughness
    x[7:10] = np.clip(principled.specular_tint, 0, 1)
    if principled.coat_weight > 0:
        x[COAT] = [principled.coat_weight, principled.coat_roughness, 0.2, 1, 1, 1]
        _keep_dielectric(x, ior_from_f0(f0))
    return x


def _with_layer(x: Array, layer: slice) -> Array:
    """Start values with a coat or a fuzz of moderate weight."""
    start = x.copy()
    if layer == COAT:
        start[COAT] = [0.5, np.clip(0.4 * x[ROUGHNESS], 0.05, 0.6), 0.2, 1, 1, 1]
        _keep_dielectric(start, ior_from_f0(float(x[F0_ROOT]) ** 2))
    else:
        start[FUZZ] = [0.1, 0.5, *np.clip(x[:3], 0.6, 1.0)]
    return start


def _keep_dielectric(x: Array, eta: float) -> None:
    """Change the index of the dielectric so that below the coat it acts as ``eta``, where the coat
    leaves it more than its own index."""
    weight, coat_ior = float(x[COAT.start]), ior_from_f0(float(x[COAT.start + 2]) ** 2)
    ior = max(eta / (1.0 - weight + weight / coat_ior), coat_ior + 0.02)
    x[F0_ROOT] = np.sqrt(f0_from_ior(ior))


def _surface(x: Array) -> OpenPBR:
    """The surface with these unknowns."""
    f0, coated = float(x[F0_ROOT]) ** 2, float(x[COAT.start]) > 0
    by_weight = not coated and x[METALNESS] == 0 and f0 < F0_OF_GLASS
    return OpenPBR(
        base_color=np.clip(x[:3] ** 2, 0, 1),
        base_diffuse_roughness=float(x[DIFFUSE_ROUGHNESS]),
        base_metalness=float(x[METALNESS]),
        specular_weight=f0 / F0_OF_GLASS if by_weight else 1.0,
        specular_color=np.array(x[7:10]),
        specular_roughness=float(x[ROUGHNESS]),
        specular_ior=GLASS if by_weight else ior_from_f0(f0),
        coat_weight=float(x[COAT.start]),
        coat_roughness=float(x[COAT.start + 1]),
        coat_ior=ior_from_f0(float(x[COAT.start + 2]) ** 2) if coated else OpenPBR.coat_ior,
        coat_color=np.array(x[COAT.start + 3 : COAT.stop] ** 2) if coated else np.ones(3),
        coat_darkening=0.0,
        fuzz_weight=float(x[FUZZ.start]),
        fuzz_roughness=float(x[FUZZ.start + 1]) if x[FUZZ.start] > 0 else OpenPBR.fuzz_roughness,
        fuzz_color=np.array(x[FUZZ.start + 2 :] ** 2) if x[FUZZ.start] > 0 else np.ones(3),
    )


def _places(part: slice) -> Sequence[int]:
    return range(part.start, part.stop)


def _error(goal: FitObjective, x: Array) -> float:
    """Square root of the objective."""
    return goal.cost(_surface(x).at(goal.where)) ** 0.5


def _purest(goal: FitObjective, mixed: Array, free: Sequence[int]) -> Array:
    """The pure dielectric or metal that fits nearly as well as the mixture, else the mixture."""
    if mixed[METALNESS] in (0.0, 1.0):
        return mixed
    others = [place for place in free if place != METALNESS]
    for pure in (0.0, 1.0):
        start = mixed.copy()
        start[METALNESS] = pure
        x = _descend(goal, start, others)
        if _error(goal, x) < PURE_TOLERANCE * _error(goal, mixed) + 1e-4:
            return x
    return mixed


def _descend(goal: FitObjective, start: Array, free: Sequence[int]) -> Array:
    """Least squares over the ``free`` unknowns; the others stay at their start values."""
    places = list(free)
    low, high = LOWER[places], UPPER[places]

    def whole(part: Array) -> Array:
        x = start.copy()
        x[places] = part
        return x

    margin = 1e-3 * (high - low)
    first = np.clip(start[places], low + margin, high - margin)

    def residual(part: Array) -> Array:
        found = goal.residual(_surface(whole(part)).at(goal.where))
        return np.concatenate([found, PULL * (part - first)])

    result = least_squares(
        residual,
        first,
        bounds=(low, high),
        diff_step=1e-4,
        xtol=1e-5,
        ftol=1e-5,
        max_nfev=MAX_EVALUATIONS,
    )
    settled = whole(np.asarray(result.x))
    for place in (METALNESS, DIFFUSE_ROUGHNESS, COAT.start, FUZZ.start):
        if settled[place] < NEGLIGIBLE_WEIGHT:
            settled[place] = 0.0
    if settled[METALNESS] > 1.0 - NEGLIGIBLE_WEIGHT:
        settled[METALNESS] = 1.0
    return settled
