"""Errors of a fitted BRDF: all measures that docs/method/experiments.md uses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from patina.core.angles import Angles, cosines, merl_grid
from patina.core.basis import Basis, PrincipalBRDF
from patina.core.brdf.metrics import log_ratio
from patina.core.samples import SampleTable

Evaluate = Callable[[Angles], NDArray[np.floating]]

LIMIT = 80.0  # degrees: largest angle of light and view, for the log and cube-root errors
SPECULAR = 10.0  # degrees of θh: the view is within twice that of the mirror direction
PEAK = 5.0  # degrees of θh: cells of the highlight's peak
GRAZING = float(np.radians(65.0))  # of θd: beyond the largest angle of the eight photos
BANDS = tuple(np.radians((0.0, 30.0, 60.0, 80.0)))  # of θd, in which the peak is also evaluated
EVERY = 3  # step in the 180 φd cells: errors change by less than 1 % of their value


@dataclass(frozen=True)
class Cells:
    """Visible cells of the MERL grid, at their centres. flat: (n,) index in the grid; near: light
    and view within LIMIT; specular, peak: the subset with θh below SPECULAR and PEAK."""

    angles: Angles
    flat: NDArray[np.intp]
    cos_i: NDArray[np.float32]
    cos_product: NDArray[np.float32]
    near: NDArray[np.bool_]
    specular: NDArray[np.bool_]
    peak: NDArray[np.bool_]


@dataclass(frozen=True)
class Errors:
    """log_rms, cube_root: light and view within 80° (core/brdf/metrics.py). relative_l2: all
    visible cells, ‖fit − truth‖/‖truth‖ (the paper). specular_l2: the same for θh < 10°, light and
    view within 80°. peak: fit ÷ truth at θh < 5°, geometric mean over the cells of the channels'
    sum; peaks: the same separately for θd of 0–30°, 30–60°, 60–80°. seen_l2: relative L2 of the
    cells that contain a sample (NaN: not computed).

    The names of the fields are the keys of the stored records.
    """

    log_rms: float
    cube_root: float
    relative_l2: float
    specular_l2: float
    peak: float
    peaks: tuple[float, ...]
    seen_l2: float = float("nan")


@lru_cache(maxsize=2)
def cells(every: int = EVERY) -> Cells:
    """Return the cells that are compared, every ``every``-th one in φd."""
    centres = Angles(*(a[:, :, every // 2 :: every] for a in merl_grid.node_angles(0.5)))
    flat = np.arange(90 * 90 * 180).reshape(merl_grid.SHAPE)[:, :, every // 2 :: every]
    seen = merl_grid.visible(centres)
    angles = Angles(*(a[seen] for a in centres))
    cos_i, cos_o = cosines(*angles)
    near = np.minimum(cos_i, cos_o) >= np.cos(np.radians(LIMIT))
    return Cells(
        angles,
        flat[seen],
        cos_i.astype(np.float32),
        (cos_i * cos_o).astype(np.float32),
        near,
        near & (angles.theta_h < np.radians(SPECULAR)),
        near & (angles.theta_h < np.radians(PEAK)),
    )


@dataclass(frozen=True)
class Reference:
    """True BRDF at the compared cells. values: (n, 3) in 1/sr."""

    values: NDArray[np.float64]
    every: int = EVERY

    @classmethod
    def of(cls, truth: Evaluate, every: int = EVERY) -> Reference:
        """Evaluate the true BRDF of a material."""
        return cls(_at(truth, cells(every).angles), every)

    def errors(self, fit: Evaluate, seen: NDArray[np.bool_] | None = None) -> Errors:
        """Return all errors of a fit; seen: (n,) cells with samples, of :func:`covered`."""
        c = cells(self.every)
        a, b = _at(fit, c.angles), self.values
        root_a, root_b = (np.cbrt(x[c.near] * c.cos_i[c.near, None]) for x in (a, b))
        log = log_ratio(a[c.near].T, b[c.near].T, c.cos_product[c.near])
        peak = np.log((a[c.peak].sum(axis=1) + 1e-6) / (b[c.peak].sum(axis=1) + 1e-6))
        theta_d = c.angles.theta_d[c.peak]
        return Errors(
            log_rms=_rms(log),
            cube_root=_rms(root_a - root_b),
            relative_l2=_relative(a, b),
            specular_l2=_relative(a[c.specular], b[c.specular]),
            peak=float(np.exp(peak.mean())),
            peaks=tuple(
                float(np.exp(peak[(theta_d >= low) & (theta_d < high)].mean()))
                for low, high in pairwise(BANDS)
            ),
            seen_l2=float("nan") if seen is None else _relative(a[seen], b[seen]),
        )

    def projected(self, basis: Basis, count: int, eta: float = 0.3) -> PrincipalBRDF:
        """Project the truth on ``count`` components, the best that a fit in this basis is expected
        to reach: least squares of mapped values over cells with light and view within LIMIT."""
        c = cells(self.every)
        angles = Angles(*(a[c.near] for a in c.angles))
        return PrincipalBRDF(basis, basis.project(self.values[c.near], angles, count, eta))


def errors(
    fit: Evaluate, truth: Evaluate, seen: NDArray[np.bool_] | None = None, every: int = EVERY
) -> Errors:
    """Return all errors of a fit; evaluates the truth again at each call."""
    return Reference.of(truth, every).errors(fit, seen)


def covered(table: SampleTable, every: int = EVERY) -> NDArray[np.bool_]:
    """Return (n,), whether a compared cell contains at least one sample."""
    hit = np.zeros(90 * 90 * 180, bool)
    ih, idx, ip = merl_grid.index(table.angles)
    hit[np.ravel_multi_index((ih, idx, ip), merl_grid.SHAPE)] = True
    return hit[cells(every).flat]


def projected(basis: Basis, truth: Evaluate, count: int, eta: float = 0.3) -> PrincipalBRDF:
    """As :meth:`Reference.projected`; evaluates the truth again at each call."""
    return Reference.of(truth).projected(basis, count, eta)


def image_error(
    predicted: NDArray[np.floating], measured: NDArray[np.floating], dark: float = 0.05
) -> tuple[float, float]:
    """Return (relative RMS ‖L̂ − L‖/‖L‖, median over pixels that are not dark of mean |L̂ − L| /
    mean L): the two errors that Patina reports for held-out photos."""
    difference = predicted.astype(np.float64) - measured
    level = measured.mean(axis=1)
    bright = level > dark * np.median(level)
    typical = np.median(np.abs(difference).mean(axis=1)[bright] / level[bright])
    return float(np.linalg.norm(difference) / np.linalg.norm(measured)), float(typical)


def _at(evaluate: Evaluate, angles: Angles) -> NDArray[np.float64]:
    return np.asarray(evaluate(angles), np.float64)


def _relative(a: NDArray, b: NDArray) -> float:
    return float(np.linalg.norm(a - b) / max(float(np.linalg.norm(b)), 1e-12))


def _rms(x: NDArray) -> float:
    return float(np.sqrt(np.mean(np.square(x))))
