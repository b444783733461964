"""Metashape's lens distortion, and its inverse.

Agisoft Metashape Professional, User Manual, appendix "Camera models". With r² = x² + y²:

    x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸) + (p1 (r² + 2x²) + 2 p2 xy)(1 + p3 r² + p4 r⁴)
    y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸) + (p2 (r² + 2y²) + 2 p1 xy)(1 + p3 r² + p4 r⁴)

p1 and p2 are OpenCV's p2 and p1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BLOCK = 1 << 18  # points solved together
TABLE_SIZE = 4096  # radii in the table for the initial guess
MAX_NEWTON_STEPS = 30  # three to five suffice unless a point lies on the fold
NEWTON_TOLERANCE = 1e-13  # remaining error, in units of the focal length


@dataclass(frozen=True)
class Calibration:
    """Metashape's parameters. f, cx, cy (absolute), b1, b2: pixels; the others have no unit."""

    f: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    p3: float = 0.0
    p4: float = 0.0
    b1: float = 0.0
    b2: float = 0.0

    @property
    def radial(self) -> tuple[float, float, float, float]:
        """k1 to k4."""
        return self.k1, self.k2, self.k3, self.k4

    @property
    def tangential(self) -> bool:
        """Whether the lens has tangential distortion (without p1 and p2, p3 and p4 have no
        effect)."""
        return self.p1 != 0 or self.p2 != 0


def distort(lens: Calibration, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """(x', y', Jacobian (2, 2, n)) of undistorted x, y (n,): the equations in the module's
    docstring."""
    s = x * x + y * y
    radial = 1 + s * (lens.k1 + s * (lens.k2 + s * (lens.k3 + s * lens.k4)))
    slope = lens.k1 + s * (2 * lens.k2 + s * (3 * lens.k3 + s * 4 * lens.k4))
    growth = 1 + s * (lens.p3 + s * lens.p4)
    growth_slope = lens.p3 + 2 * s * lens.p4
    shift_x = lens.p1 * (s + 2 * x * x) + 2 * lens.p2 * x * y
    shift_y = lens.p2 * (s + 2 * y * y) + 2 * lens.p1 * x * y
    cross = 2 * x * y * slope + 2 * (lens.p1 * y + lens.p2 * x) * growth
    jacobian = np.array(
        [
            [
                radial
                + 2 * x * x * slope
                + (6 * lens.p1 * x + 2 * lens.p2 * y) * growth
                + 2 * x * shift_x * growth_slope,
                cross + 2 * y * shift_x * growth_slope,
            ],
            [
                cross + 2 * x * shift_y * growth_slope,
                radial
                + 2 * y * y * slope
                + (6 * lens.p2 * y + 2 * lens.p1 * x) * growth
                + 2 * y * shift_y * growth_slope,
            ],
        ]
    )
    return x * radial + shift_x * growth, y * radial + shift_y * growth, jacobian


def determinant(jacobian: Array) -> Array:
    """(n,) determinant of a Jacobian (2, 2, n): positive where the lens does not fold."""
    return np.asarray(jacobian[0, 0] * jacobian[1, 1] - jacobian[0, 1] * jacobian[1, 0])


def undistort(lens: Calibration, bent_x: Array, bent_y: Array, limit: float) -> tuple[Array, Array]:
    """Undistorted x, y (n,), within the radius ``limit``, of distorted x', y'; NaN where there is
    no solution."""
    guess = _radial_guess(lens.radial, limit, np.hypot(bent_x, bent_y))
    x, y = np.empty_like(bent_x), np.empty_like(bent_y)
    for start in range(0, len(bent_x), BLOCK):
        part = slice(start, start + BLOCK)
        x[part], y[part] = _invert(lens, bent_x[part], bent_y[part], guess)
    with np.errstate(invalid="ignore"):
        beyond = ~(np.hypot(x, y) <= limit * (1 + 1e-12))
    x[beyond] = y[beyond] = np.nan
    return x, y


def _radial_guess(
    coefficients: tuple[float, float, float, float], limit: float, bent: Array
) -> Callable[[Array], Array]:
    """Function r' → r for the radial terms only, from a table up to the fold."""
    finite = bent[np.isfinite(bent)]
    farthest = 1.05 * finite.max(initial=0.0) + 0.1
    k = np.array([0.0, 1.0, 0.0, coefficients[0], 0.0, coefficients[1], 0.0, coefficients[2], 0.0])
    k = np.append(k, coefficients[3])
    end = min(limit, 1.0)
    while end < limit and np.polynomial.polynomial.polyval(end, k) < farthest and end < 1e6:
        end = min(2 * end, limit)
    radii = np.linspace(0.0, end, TABLE_SIZE)
    table = np.maximum.accumulate(np.polynomial.polynomial.polyval(radii, k))
    return lambda values: np.interp(values, table, radii)


def _invert(
    lens: Calibration, bent_x: Array, bent_y: Array, guess: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Undistorted x, y of distorted coordinates, by Newton's method with step halving; NaN where it
    does not converge."""
    bent = np.hypot(bent_x, bent_y)
    with np.errstate(invalid="ignore", divide="ignore"):
        factor = np.where(bent > 0, guess(bent) / bent, 1.0)
    x, y = bent_x * factor, bent_y * factor
    active = np.flatnonzero(np.isfinite(bent))
    error = np.full_like(bent, np.inf)
    for _ in range(MAX_NEWTON_STEPS):
        now_x, now_y, jacobian = distort(lens, x[active], y[active])
        off_x, off_y = now_x - bent_x[active], now_y - bent_y[active]
        error[active] = np.hypot(off_x, off_y)
        going = error[active] > NEWTON_TOLERANCE * (1 + bent[active])
        active, off_x, off_y, jacobian = (
            active[going],
            off_x[going],
            off_y[going],
            jacobian[..., going],
        )
        if not len(active):
            break
        with np.errstate(all="ignore"):
            inverse = 1.0 / determinant(jacobian)
            step_x = inverse * (jacobian[1, 1] * off_x - jacobian[0, 1] * off_y)
            step_y = inverse * (jacobian[0, 0] * off_y - jacobian[1, 0] * off_x)
        step_scale = (np.isfinite(step_x) & np.isfinite(step_y)).astype(float)
        step_x, step_y = np.nan_to_num(step_x), np.nan_to_num(step_y)
        for _ in range(6):
            with np.errstate(all="ignore"):
                to_x, to_y, _j = distort(
                    lens, x[active] - step_scale * step_x, y[active] - step_scale * step_y
                )
                worse = ~(np.hypot(to_x - bent_x[active], to_y - bent_y[active]) <= error[active])
            if not worse.any():
                break
            step_scale = np.where(worse, step_scale / 2, step_scale)
        x[active] -= step_scale * step_x
        y[active] -= step_scale * step_y
    _, _, jacobian = distort(lens, x, y)
    with np.errstate(invalid="ignore"):
        diverged = ~((error <= 1e-9 * (1 + bent)) & (determinant(jacobian) > 0))
    x[diverged] = y[diverged] = np.nan
    return x, y
