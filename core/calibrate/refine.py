"""Refine lights from the photos themselves: where they stand so that ONE material explains all.

Every pixel's reflectance under a guessed light is explained by a few principal components; what
they cannot explain is least where the light is right. The components' coefficients are solved for
inside (variable projection, Golub & Pereyra 1973), the lights' numbers outside.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..angles import Angles, half_difference
from ..basis import Basis, mapping
from ..geometry import RayScene
from ..geometry.view import cast_shadow
from ..light import Light
from .movable import Movable, movable
from .seen import Seen, not_dark

Array = NDArray[np.float64]

COMPONENTS = 20  # with 5 what the components cannot make moves the light instead
RIDGE = 1.0
SOFT = 0.3  # log residuals beyond this are stains and wrong normals: they count less
GRAZING = (0.1, 0.3)  # cos θi: below the first a pixel counts least, above the second fully
LEAST = 0.2  # never not at all: what is bright is lit, a light that does not reach it is wrong
UNLIT = 0.03  # cos θi of what a light does not reach
ROUNDS = 3  # the shadows move with the light
GROUPS = 8  # of photos, left out in turn for the uncertainty


@dataclass(frozen=True)
class Refined:
    """lights: by name, all of them. moved: name → {number: (value, standard error)}; the error is
    the jackknife's over photos, NaN with fewer than three. before, after: median |log residual| of
    the pixels: what the material cannot explain."""

    lights: dict[str, Light]
    moved: dict[str, dict[str, tuple[float, float]]]
    before: float
    after: float


def refine_lights(
    lights: Mapping[str, Light],
    free: Sequence[str],
    seen: Sequence[tuple[str, Seen]],
    rays: RayScene,
    basis: Basis,
) -> Refined:
    """lights: by name; free: names of those to refine; seen: (name of its light, pixels) of every
    photo. The strengths of the lights are kept as they are."""
    names = [name for name, _ in seen]
    pixels = not_dark([part for _, part in seen])
    reach = float(
        np.median([np.linalg.norm(s.camera.pose.centre - s.point.mean(axis=0)) for s in pixels])
    )
    problem = _Problem(dict(lights), {name: movable(lights[name], reach) for name in free}, basis)
    x = problem.start
    lit = _lit(problem.lights(x), names, pixels, rays)
    before = _typical(problem.residuals(x, names, lit))
    for _ in range(ROUNDS):
        x = problem.solve(x, names, lit)
        lit = _lit(problem.lights(x), names, pixels, rays)
    after = _typical(problem.residuals(x, names, lit))
    errors = problem.jackknife(x, names, lit)
    moved, at = {}, 0
    for name, one in problem.free.items():
        k = len(one.names)
        values = zip(one.names, x[at : at + k], errors[at : at + k], strict=True)
        moved[name] = {label: (float(value), float(error)) for label, value, error in values}
        at += k
    return Refined(problem.lights(x), moved, before, after)


@dataclass(frozen=True)
class _Problem:
    fixed: dict[str, Light]
    free: dict[str, Movable]
    basis: Basis

    @property
    def start(self) -> Array:
        return np.concatenate([one.start for one in self.free.values()])

    def lights(self, x: Array) -> dict[str, Light]:
        found, at = dict(self.fixed), 0
        for name, one in self.free.items():
            found[name] = one.light(x[at : at + len(one.names)])
            at += len(one.names)
        return found

    def solve(
        self, x: Array, names: Sequence[str], pixels: Sequence[Seen], most: int = 40
    ) -> Array:
        """The free numbers (k,) that leave least unexplained, from x on."""
        parts = list(self.free.values())
        size = np.concatenate([one.size for one in parts])
        found = least_squares(
            lambda y: self.residuals(y, names, pixels),
            x,
            bounds=(
                np.concatenate([one.low for one in parts]),
                np.concatenate([one.high for one in parts]),
            ),
            x_scale=size,
            jac=lambda y: self._slopes(y, 1e-3 * size, names, pixels),
            loss="soft_l1",
            f_scale=SOFT,
            max_nfev=most,
        )
        return np.asarray(found.x)

    def _slopes(self, x: Array, step: Array, names: Sequence[str], pixels: Sequence[Seen]) -> Array:
        columns = []
        for k, h in enumerate(step):
            up, down = x.copy(), x.copy()
            up[k], down[k] = x[k] + h, x[k] - h
            difference = self.residuals(up, names, pixels) - self.residuals(down, names, pixels)
            columns.append(difference / (2 * h))
        return np.stack(columns, axis=1)

    def residuals(self, x: Array, names: Sequence[str], pixels: Sequence[Seen]) -> Array:
        """(n,) weighted log residual of every pixel's reflectance against the best material."""
        lights = self.lights(x)
        weight, rho, angles = [], [], []
        for name, seen in zip(names, pixels, strict=True):
            incidence = lights[name].incidence(seen.point, seen.camera)
            cos_i = np.einsum("ij,ij->i", seen.normal, incidence.towards)
            angles.append(half_difference(seen.normal, incidence.towards, seen.view))
            strength = incidence.irradiance.mean(axis=1) * np.maximum(cos_i, UNLIT)
            rho.append(seen.radiance / strength)
            weight.append(seen.weight)
        w = np.concatenate(weight)
        r = np.concatenate(rho)
        joined = Angles(*(np.concatenate(part) for part in zip(*angles, strict=True)))
        mean, q = self.basis.rows(joined, COMPONENTS)
        if not all(light.known for light in lights.values()):
            r = r * _level(r, mean, joined, w)
        mapped = mapping.log_weighted(r[:, None], mapping.cos_map(joined))[:, 0] - mean
        rows = q.astype(np.float64)
        c = np.zeros(COMPONENTS)
        for _ in range(3):
            left = mapped - rows @ c
            robust = w / np.sqrt(1 + (left / SOFT) ** 2)
            weighted = rows * robust[:, None]
            c = np.linalg.solve(weighted.T @ rows + RIDGE * np.eye(COMPONENTS), weighted.T @ mapped)
        return np.asarray(np.sqrt(w) * (mapped - rows @ c))

    def jackknife(self, x: Array, names: Sequence[str], pixels: Sequence[Seen]) -> Array:
        """(k,) standard errors: how much the numbers change with the photos left out in turn."""
        groups = min(GROUPS, len(pixels))
        if groups < 3 or len(set(names)) > 1:
            return np.full(len(x), np.nan)
        found = []
        for group in range(groups):
            rest = [i for i in range(len(pixels)) if i % groups != group]
            found.append(self.solve(x, [names[i] for i in rest], [pixels[i] for i in rest], 8))
        spread = np.array(found) - np.mean(found, axis=0)
        return np.asarray(np.sqrt((groups - 1) / groups * np.sum(spread**2, axis=0)))


def _lit(
    lights: Mapping[str, Light], names: Sequence[str], pixels: Sequence[Seen], rays: RayScene
) -> list[Seen]:
    """The pixels no other part of the mesh shadows, weighted by how well their irradiance is known.

    The weights hold for a round: were they to follow the light, lights that light little would win.
    """
    found = []
    for name, seen in zip(names, pixels, strict=True):
        incidence = lights[name].incidence(seen.point, seen.camera)
        cos_i = np.einsum("ij,ij->i", seen.normal, incidence.towards)
        dark = cast_shadow(rays, seen.point, seen.normal, incidence.towards, incidence.distance)
        weight = np.clip((cos_i - GRAZING[0]) / (GRAZING[1] - GRAZING[0]), LEAST, 1)
        found.append(replace(seen, weight=weight).select(~(dark & (cos_i > 0))))
    return found


def _level(rho: Array, mean: NDArray[np.floating], angles: Angles, weight: Array) -> float:
    """What brings the typical reflectance to the basis' mean material's (samples/level.py)."""
    full = weight > 0.99
    if not full.any():
        return 1.0
    typical = np.median(np.exp(mean[full]) - mapping.EPSILON)
    return float(typical / np.median((rho * mapping.cos_map(angles))[full]))


def _typical(residuals: Array) -> float:
    return float(np.median(np.abs(residuals))) if residuals.size else 0.0
