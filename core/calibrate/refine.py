"""Refine lights from the photos: the parameters for which ONE material explains all photos best.

The reflectance of every pixel under the current lights is fitted by a few principal components; the
residual is smallest where the lights are right. The coefficients of the components are solved for
in an inner step (variable projection, Golub & Pereyra 1973), the parameters of the lights in the
outer one. Only ratios of radiance count: the basis prefers a certain level of reflectance, and
moving a lamp would be an easy way to reach it.
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
from .movable import FreeLight, free_light
from .seen import CalibrationPixels, not_dark

Array = NDArray[np.float64]

COMPONENTS = 20  # with 5, reflectance that they cannot represent moves the light instead
RIDGE = 1.0
SOFT_L1_SCALE = 0.3  # log residual beyond which (stains, wrong normals) weights decrease
GRAZING = (0.1, 0.3)  # cos θi: MIN_WEIGHT below the first, full weight above the second
MIN_WEIGHT = 0.2  # not 0: a bright pixel is lit, so a light that does not reach it is wrong
MIN_COSINE = 0.03  # cos θi of pixels that a light does not reach
ROUNDS = 3  # shadows and weights are computed anew in each
GROUPS = 8  # of photos, left out in turn for the jackknife
MIN_PIXELS = 200  # of a light that is refined
AT_BOUND = 1e-3  # distance from a bound, relative to the range of the parameter


@dataclass(frozen=True)
class Refined:
    """lights: all, by name. moved: name → {parameter: (value, standard error)}; the errors are
    those of the jackknife over photos, NaN with fewer than three photos, with several lights, and
    for a parameter at the end of its range. before, after: median |log residual| of the pixels.
    notes: sentences for the report."""

    lights: dict[str, Light]
    moved: dict[str, dict[str, tuple[float, float]]]
    before: float
    after: float
    notes: tuple[str, ...]


def refine_lights(
    lights: Mapping[str, Light],
    free: Sequence[str],
    seen: Sequence[tuple[str, CalibrationPixels]],
    rays: RayScene,
    basis: Basis,
) -> Generator[float, None, Refined]:
    """Refine some lights of a capture; a generator that yields the fraction done.

    lights: by name; free: names of those to refine; seen: (name of its light, pixels) of every
    photo. The strengths of the lights are not changed. Raises PatinaError where too few pixels are
    usable.
    """
    names = [name for name, _ in seen]
    pixels = not_dark([part for _, part in seen])
    for name in free:
        have = sum(len(s.radiance) for n, s in zip(names, pixels, strict=True) if n == name)
        if have < MIN_PIXELS:
            raise PatinaError(
                f"{have} pixels of the light's photos show bright, gently curved surface of one "
                f"material; expected at least {MIN_PIXELS}; add photos or do not refine this light"
            )
    away = [np.linalg.norm(s.camera.pose.centre - s.point.mean(0)) for s in pixels if len(s.point)]
    reach = float(np.median(away))
    problem = _Problem(
        dict(lights), {name: free_light(lights[name], reach) for name in free}, basis
    )
    x = problem.start
    lit = _lit(problem.lights(x), names, pixels, rays)
    before = _typical(problem.residuals(x, names, lit))
    for done in range(ROUNDS):
        yield 0.5 * done / ROUNDS
        x = problem.solve(x, names, lit)
        lit = _lit(problem.lights(x), names, pixels, rays)
        problem.cache.clear()
    after = _typical(problem.residuals(x, names, lit))
    errors = yield from problem.jackknife(x, names, lit)
    return _result(problem, x, errors, before, after)


def _result(problem: _Problem, x: Array, errors: Array, before: float, after: float) -> Refined:
    """The result: values with standard errors, and notes."""
    moved, notes, at = {}, [], 0
    for name, one in problem.free.items():
        k = len(one.names)
        values, spread = x[at : at + k], errors[at : at + k].copy()
        tolerance = AT_BOUND * (one.high - one.low)
        floor = np.array([label.startswith("1/") for label in one.names])  # 0: no beam
        ends = ((values < one.low + tolerance) & ~floor) | (values > one.high - tolerance)
        spread[ends] = np.nan
        for label in np.array(one.names)[ends]:
            notes.append(
                f"Light {name!r}: {label} reached the end of its range; the photos do not "
                "determine it. Give its value, or a better start."
            )
        pairs = zip(one.names, values, spread, strict=True)
        moved[name] = {label: (float(value), float(error)) for label, value, error in pairs}
        at += k
    if np.isnan(errors).all():
        notes.append(
            "The refined lights have no standard errors: these need a single light with at least "
            "three photos."
        )
    if not after < before:
        notes.append("Refining the lights did not reduce the unexplained residual.")
    return Refined(problem.lights(x), moved, before, after, tuple(notes))


@dataclass(frozen=True)
class _Rows:
    """One photo's pixels in the basis, under one light: reflectance of unknown level (n,), cosMap
    (n,), the basis' centre (n,) and rows (n, k)."""

    rho: Array
    cos_map: Array
    centre: NDArray[np.floating]
    rows: NDArray[np.floating]


@dataclass(frozen=True)
class _Problem:
    """Least squares over the parameters of the free lights. cache: rows by photo and parameters."""

    fixed: dict[str, Light]
    free: dict[str, FreeLight]
    basis: Basis
    cache: dict[tuple[int, bytes], _Rows] = field(default_factory=dict)

    @property
    def start(self) -> Array:
        """(k,) start values."""
        return np.concatenate([one.start for one in self.free.values()])

    def lights(self, x: Array) -> dict[str, Light]:
        """All lights, with parameters x (k,) of the free ones."""
        found = dict(self.fixed)
        for name, part in self.parts(x).items():
            found[name] = self.free[name].light(part)
        return found

    def parts(self, x: Array) -> dict[str, Array]:
        """The parameters of each free light."""
        found, at = {}, 0
        for name, one in self.free.items():
            found[name] = x[at : at + len(one.names)]
            at += len(one.names)
        return found

    def solve(
        self, x: Array, names: Sequence[str], pixels: Sequence[CalibrationPixels], most: int = 40
    ) -> Array:
        """The parameters (k,) with the smallest residual, starting from x; most: largest number of
        evaluations."""
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
            f_scale=SOFT_L1_SCALE,
            max_nfev=most,
        )
        return np.asarray(found.x)

    def _slopes(
        self, x: Array, step: Array, names: Sequence[str], pixels: Sequence[CalibrationPixels]
    ) -> Array:
        """(n, k) Jacobian of the residuals, by central differences."""
        columns = []
        for k, h in enumerate(step):
            up, down = x.copy(), x.copy()
            up[k], down[k] = x[k] + h, x[k] - h
            difference = self.residuals(up, names, pixels) - self.residuals(down, names, pixels)
            columns.append(difference / (2 * h))
        return np.stack(columns, axis=1)

    def residuals(
        self, x: Array, names: Sequence[str], pixels: Sequence[CalibrationPixels]
    ) -> Array:
        """(n,) weighted log residual of every pixel's reflectance after fitting its material."""
        parts, lights = self.parts(x), self.lights(x)
        projected = [
            self._rows(lights[name], parts.get(name), seen)
            for name, seen in zip(names, pixels, strict=True)
        ]
        rho = np.concatenate([one.rho for one in projected])
        cos_map = np.concatenate([one.cos_map for one in projected])
        centre = np.concatenate([one.centre for one in projected]).astype(np.float64)
        rows = np.concatenate([one.rows for one in projected]).astype(np.float64)
        w = np.concatenate([seen.weight for seen in pixels])
        material = np.concatenate([seen.material for seen in pixels])
        rho = rho * _level(rho, centre, cos_map, w)
        mapped = mapping.log_weighted(rho[:, None], cos_map)[:, 0] - centre
        left = np.empty_like(mapped)
        for place in np.unique(material):
            own = material == place
            left[own] = _unexplained(mapped[own], rows[own], w[own])
        return np.asarray(np.sqrt(w) * left)

    def _rows(self, light: Light, part: Array | None, seen: CalibrationPixels) -> _Rows:
        """Computed anew only for the lights that moved; others come from the cache."""
        key = (id(seen), b"" if part is None else part.tobytes())
        if key not in self.cache:
            if len(self.cache) > 4096:
                self.cache.clear()
            for old in [k for k in self.cache if k[0] == key[0]][:-3]:
                del self.cache[old]
            incidence = light.incidence(seen.point, seen.camera)
            cos_i = np.einsum("ij,ij->i", seen.normal, incidence.towards)
            angles: Angles = half_difference(seen.normal, incidence.towards, seen.view)
            strength = incidence.irradiance.mean(axis=1) * np.maximum(cos_i, MIN_COSINE)
            centre, rows = self.basis.rows(angles, COMPONENTS)
            cos_map = np.asarray(mapping.cos_map(angles), np.float64)
            self.cache[key] = _Rows(seen.radiance / strength, cos_map, centre, rows)
        return self.cache[key]

    def jackknife(
        self, x: Array, names: Sequence[str], pixels: Sequence[CalibrationPixels]
    ) -> Generator[float, None, Array]:
        """(k,) standard errors, from the parameters with each group of photos left out in turn."""
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
    """(n,) residuals of the mapped reflectances after a robust fit of the coefficients."""
    c = np.zeros(rows.shape[1])
    for _ in range(3):
        robust = weight / np.sqrt(1 + ((mapped - rows @ c) / SOFT_L1_SCALE) ** 2)
        weighted = rows * robust[:, None]
        c = np.linalg.solve(weighted.T @ rows + RIDGE * np.eye(len(c)), weighted.T @ mapped)
    return mapped - rows @ c


def _lit(
    lights: Mapping[str, Light],
    names: Sequence[str],
    pixels: Sequence[CalibrationPixels],
    rays: RayScene,
) -> list[CalibrationPixels]:
    """The pixels that are not in a cast shadow, weighted by how well their irradiance is known.

    The weights are fixed for a round: if they followed the light, lights that illuminate little
    would be preferred.
    """
    found = []
    for name, seen in zip(names, pixels, strict=True):
        incidence = lights[name].incidence(seen.point, seen.camera)
        cos_i = np.einsum("ij,ij->i", seen.normal, incidence.towards)
        dark = cast_shadow(rays, seen.point, seen.normal, incidence.towards, incidence.distance)
        weight = np.clip((cos_i - GRAZING[0]) / (GRAZING[1] - GRAZING[0]), MIN_WEIGHT, 1)
        found.append(replace(seen, weight=weight).select(~(dark & (cos_i > 0))))
    return found


def _level(rho: Array, centre: Array, cos_map: Array, weight: Array) -> float:
    """Factor that scales the median reflectance to that of the basis' mean material
    (samples/level.py)."""
    full = weight > 0.99
    if not full.any():
        return 1.0
    typical = np.median(np.exp(centre[full]) - mapping.EPSILON)
    return float(typical / np.median((rho * cos_map)[full]))


def _typical(residuals: Array) -> float:
    """Median |residual|."""
    return float(np.median(np.abs(residuals))) if residuals.size else 0.0
