"""Split a BRDF into closures that Cycles samples towards lights and a rest that it does not.

A ray portal can carry any BRDF, but is not sampled towards lights: it finds a small bright sun by
chance alone. So for every direction of view the largest part is assigned to Cycles' own closures, a
ramp over cos θi and three GGX lobes, and only the rest, of either sign, to the portal. The sum is
the BRDF for any weights; they are chosen to minimise the absolute rest, which determines the
portal's noise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from ..angles import Angles
from .hemisphere import Hemisphere

Array = NDArray[np.floating]

KNOTS = 8  # of OSL's diffuse_ramp
LOBES = 3
VIEWS = 24  # directions of view, evenly over θo
GRAZING = np.radians(89.0)  # the most grazing direction of view
CELLS = (48, 16)  # of half vectors, over θh and φh
ALPHAS = np.geomspace(0.006, 0.8, 16)  # candidates for the lobes
ROUNDS = 6  # of reweighted least squares, towards the minimum of |rest|^1.5
ALPHA_VIEWS = (2, 8, 14, 19)  # views from which the lobes' alphas are chosen


@dataclass(frozen=True)
class ClosureSplit:
    """theta_o: (v,) radians, directions of view. alpha: (LOBES,) of the GGX lobes. ramp: (v, KNOTS,
    3) of ρ·cos θi at cos θi = 0 … 1. lobes: (v, LOBES, 3) weights of the GGX lobes. rest: fraction
    of the reflected light left to the portal, in absolute value, mean over views."""

    theta_o: Array
    alpha: Array
    ramp: Array
    lobes: Array
    rest: float


def view_angles(count: int = VIEWS) -> Array:
    """(count,) θo in radians, from 0 to 89°."""
    return np.linspace(0.0, GRAZING, count)


def split(evaluate: Callable[[Angles], Array]) -> ClosureSplit:
    """The split of ``evaluate(angles) -> (n, 3)``, ρ in 1/sr."""
    theta_o = view_angles()
    spheres = [Hemisphere.of(t, *CELLS) for t in theta_o]
    reflected = [np.asarray(evaluate(s.angles), float) * s.cos_i[:, None] for s in spheres]
    few = [(spheres[i], reflected[i].mean(axis=1, keepdims=True)) for i in ALPHA_VIEWS]
    chosen: list[float] = []
    for place in (*range(LOBES), *range(LOBES)):  # greedy, then each is chosen once more
        kept = chosen[:place] + chosen[place + 1 :] if len(chosen) == LOBES else list(chosen)
        trials = [
            (sum(float(_least_rest(s, y, (*kept, a))[1][0]) for s, y in few), a)
            for a in ALPHAS
            if a not in kept
        ]
        found = min(trials)[1]
        chosen = [*kept[:place], found, *kept[place:]]
    alpha = np.array(sorted(chosen))
    ramp, lobes = np.zeros((VIEWS, KNOTS, 3)), np.zeros((VIEWS, LOBES, 3))
    left, total = 0.0, 0.0
    for v, (sphere, y) in enumerate(zip(spheres, reflected, strict=True)):
        found, rest = _least_rest(sphere, y, tuple(alpha))
        ramp[v], lobes[v] = found[:KNOTS], found[KNOTS:]
        left += float(rest.sum())
        total += float(np.sum(sphere.solid[:, None] * y))
    return ClosureSplit(theta_o, alpha, ramp, lobes, left / max(total, 1e-12))


def closures(sphere: Hemisphere, alpha: tuple[float, ...]) -> Array:
    """(n, KNOTS + lobes) ρ·cos θi of each closure with weight 1."""
    at = sphere.cos_i * (KNOTS - 1)
    low = np.minimum(at.astype(int), KNOTS - 2)
    columns = np.zeros((at.size, KNOTS + len(alpha)))
    every = np.arange(at.size)
    columns[every, low] = 1 - (at - low)
    columns[every, low + 1] = at - low
    for j, a in enumerate(alpha):
        columns[:, KNOTS + j] = sphere.where.ggx(np.sqrt(a)) * sphere.cos_i
    columns[sphere.cos_i <= 0] = 0
    return columns


def _least_rest(sphere: Hemisphere, y: Array, alpha: tuple[float, ...]) -> tuple[Array, Array]:
    """(weights (KNOTS + lobes, c) ≥ 0, rest (c,)) that minimise ∫|y − Σ weight × closure| over the
    light's directions, by iteratively reweighted non-negative least squares."""
    matrix = closures(sphere, alpha)
    kept = sphere.solid > 0
    matrix, y, solid = matrix[kept], y[kept], sphere.solid[kept]
    found, rest = np.zeros((matrix.shape[1], y.shape[1])), np.zeros(y.shape[1])
    scale = np.sqrt(solid @ matrix**2) + 1e-12
    matrix = matrix / scale
    for c in range(y.shape[1]):
        floor = 1e-3 * float(solid @ np.abs(y[:, c])) / float(solid.sum()) + 1e-12
        weight, best = solid.copy(), np.inf
        for _ in range(ROUNDS):
            weighted = matrix * weight[:, None]
            gram = weighted.T @ matrix
            gram[np.diag_indices_from(gram)] += 1e-6 * np.trace(gram) / len(gram)
            root = np.linalg.cholesky(gram)
            x, _ = nnls(root.T, np.linalg.solve(root, weighted.T @ y[:, c]), maxiter=1000)
            left = np.abs(y[:, c] - matrix @ x)
            if (now := float(solid @ left)) < best:
                best, found[:, c], rest[c] = now, x / scale, now
            weight = solid / np.sqrt(left + floor)
    return found, rest
