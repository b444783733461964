"""Refine lights from the photos themselves: where they stand so that ONE material explains all.

Every pixel's reflectance under a guessed light is explained by a few principal components; what
they cannot explain is least where the light is right. The components' coefficients are solved for
inside (variable projection, Golub & Pereyra 1973), the lights' numbers outside. Only ratios of
radiance count: the basis has a level it likes, and moving a lamp would be a cheap way to reach it.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..angles import Angles, half_difference
from ..basis import Basis, mapping
from ..errors import PatinaError
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
FEWEST = 200  # pixels that a light to be refined must have
AT_BOUND = 1e-3  # of a number's range


@dataclass(frozen=True)
class Refined:
    """lights: by name, all of them. moved: name → {number: (value, standard error)}; the error is
    the jackknife's over photos, NaN with fewer than three, where the capture has several lights,
    and for a number at the end of its range. before, after: median |log residual| of the pixels:
    what the materials cannot explain. notes: sentences for the user."""

    lights: dict[str, Light]
    moved: dict[str, dict[str, tuple[float, float]]]
    before: float
    after: float
    notes: tuple[str, ...]


def refine_lights(
    lights: Mapping[str, Light],
    free: Sequence[str],
    seen: Sequence[tuple[str, Seen]],
    rays: RayScene,
    basis: Basis,
) -> Generator[float, None, Refined]:
    """lights: by name; free: names of those to refine; seen: (name of its light, pixels) of every
    photo. The strengths of the lights are kept as they are. Yields the fraction done. Raises
    PatinaError where the photos show too little."""
    names = [name for name, _ in seen]
    pixels = not_dark([part for _, part in seen])
    for name in free:
        have = sum(len(s.radiance) for n, s in zip(names, pixels, strict=True) if n == name)
        if have < FEWEST:
            raise PatinaError(
                f"{have} pixels of its photos show calm, bright surface of one material, expected "
                f"at least {FEWEST}: the light cannot be refined from them"
            )
    away = [np.linalg.norm(s.camera.pose.centre - s.point.mean(0)) for s in pixels if len(s.point)]
    reach = float(np.median(away))
    problem = _Problem(dict(lights), {name: movable(lights[name], reach) for name in free}, basis)
    x = problem.start
    lit = _lit(problem.lights(x), names, pixels, rays)
    before = _typical(problem.residuals(x, names, lit))
    for done in range(ROUNDS):
        yield 0.5 * done / ROUNDS
        x = problem.solve(x, names, lit)
        lit = _lit(problem.lights(x), names, pixels, rays)
        problem.kept.clear()
    after = _typical(problem.residuals(x, names, lit))
    errors = yield from problem.jackknife(x, names, lit)
    return _described(problem, x, errors, before, after)


def _described(problem: _Problem, x: Array, errors: Array, before: float, after: float) -> Refined:
    moved, notes, at = {}, [], 0
    for name, one in problem.free.items():
        k = len(one.names)
        values, spread = x[at : at + k], errors[at : at + k].copy()
        room = AT_BOUND * (one.high - one.low)
        floor = np.array([label.startswith("1/") for label in one.names])  # zero means none
        ends = ((values < one.low + room) & ~floor) | (values > one.high - room)
        spread[ends] = np.nan
        for label in np.array(one.names)[ends]:
            notes.append(
                f"light {name!r}: {label} ran to the end of its range: the photos do not determine "
                "it; give it, or a better start"
            )
        pairs = zip(one.names, values, spread, strict=True)
        moved[name] = {label: (float(value), float(error)) for label, value, error in pairs}
        at += k
    if np.isnan(errors).all():
        notes.append(
            "no standard errors of the refined lights: they come from leaving photos out, of one "
            "light for three photos and more"
        )
    if not after < before:
        notes.append("refining the lights explains the photos no better than before")
    return Refined(problem.lights(x), moved, before, after, tuple(notes))


@dataclass(frozen=True)
class _Rows:
    """What one photo's pixels ask of the basis under one light: reflectance before any level (n,),
    cosMap (n,), the basis' centre (n,) and rows (n, k)."""

    rho: Array
    cos_map: Array
    centre: NDArray[np.floating]
    rows: NDArray[np.floating]


@dataclass(frozen=True)
class _Problem:
    fixed: dict[str, Light]
    free: dict[str, Movable]
    basis: Basis
    kept: dict[tuple[int, bytes], _Rows] = field(default_factory=dict)

    @property
    def start(self) -> Array:
        return np.concatenate([one.start for one in self.free.values()])

    def lights(self, x: Array) -> dict[str, Light]:
        found = dict(self.fixed)
        for name, part in self.parts(x).items():
            found[name] = self.free[name].light(part)
        return found

    def parts(self, x: Array) -> dict[str, Array]:
        """Each free light's own numbers."""
        found, at = {}, 0
        for name, one in self.free.items():
            found[name] = x[at : at + len(one.names)]
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
        """(n,) weighted log residual of every pixel's reflectance against the best materials."""
        parts, lights = self.parts(x), self.lights(x)
        asked = [
            self._rows(lights[name], parts.get(name), seen)
            for name, seen in zip(names, pixels, strict=True)
        ]
        rho = np.concatenate([one.rho for one in asked])
        cos_map = np.concatenate([one.cos_map for one in asked])
        centre = np.concatenate([one.centre for one in asked]).astype(np.float64)
        rows = np.concatenate([one.rows for one in asked]).astype(np.float64)
        w = np.concatenate([seen.weight for seen in pixels])
        material = np.concatenate([seen.material for seen in pixels])
        rho = rho * _level(rho, centre, cos_map, w)
        mapped = mapping.log_weighted(rho[:, None], cos_map)[:, 0] - centre
        left = np.empty_like(mapped)
        for place in np.unique(material):
            own = material == place
            left[own] = _unexplained(mapped[own], rows[own], w[own])
        return np.asarray(np.sqrt(w) * left)

    def _rows(self, light: Light, part: Array | None, seen: Seen) -> _Rows:
        """Computed anew only for the lights that moved: the others' photos ask the same again."""
        key = (id(seen), b"" if part is None else part.tobytes())
        if key not in self.kept:
            if len(self.kept) > 4096:
                self.kept.clear()
            for old in [k for k in self.kept if k[0] == key[0]][:-3]:
                del self.kept[old]
            incidence = light.incidence(seen.point, seen.camera)
            cos_i = np.einsum("ij,ij->i", seen.normal, incidence.towards)
            angles: Angles = half_difference(seen.normal, incidence.towards, seen.view)
            strength = incidence.irradiance.mean(axis=1) * np.maximum(cos_i, UNLIT)
            centre, rows = self.basis.rows(angles, COMPONENTS)
            cos_map = np.asarray(mapping.cos_map(angles), np.float64)
            self.kept[key] = _Rows(seen.radiance / strength, cos_map, centre, rows)
        return self.kept[key]

    def jackknife(
        self, x: Array, names: Sequence[str], pixels: Sequence[Seen]
    ) -> Generator[float, None, Array]:
        """(k,) standard errors: how much the numbers change with the photos left out in turn."""
        groups = min(GROUPS, len(pixels))
        if groups < 3 or len(set(names)) > 1:
            return np.full(len(x), np.nan)
        found = []
        for group in range(groups):
            yield 0.5 + 0.5 * group / groups
            rest = [i for i in range(len(pixels)) if i % groups != group]
            found.append(self.solve(x, [names[i] for i in rest], [pixels[i] for i in rest], 8))
        spread = np.array(found) - np.mean(found, axis=0)
        return np.asarray(np.sqrt((groups - 1) / groups * np.sum(spread**2, axis=0)))


def _unexplained(mapped: Array, rows: Array, weight: Array) -> Array:
    """(n,) what the best coefficients leave of the mapped reflectances, stains counting little."""
    c = np.zeros(rows.shape[1])
    for _ in range(3):
        robust = weight / np.sqrt(1 + ((mapped - rows @ c) / SOFT) ** 2)
        weighted = rows * robust[:, None]
        c = np.linalg.solve(weighted.T @ rows + RIDGE * np.eye(len(c)), weighted.T @ mapped)
    return mapped - rows @ c


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


def _level(rho: Array, centre: Array, cos_map: Array, weight: Array) -> float:
    """What brings the typical reflectance to the basis' mean material's (samples/level.py)."""
    full = weight > 0.99
    if not full.any():
        return 1.0
    typical = np.median(np.exp(centre[full]) - mapping.EPSILON)
    return float(typical / np.median((rho * cos_map)[full]))


def _typical(residuals: Array) -> float:
    return float(np.median(np.abs(residuals))) if residuals.size else 0.0
