"""Metashape's distortion of a lens, and its inverse.

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

BLOCK = 1 << 18  # points solved at once
TABLE = 4096  # radii tabulated for a first guess
STEPS = 30  # of Newton's method; three to five do it unless a point lies on the fold
EXACT = 1e-13  # remaining error, in units of the focal length


@dataclass(frozen=True)
class Calibration:
    """Metashape's parameters; pixels: f, cx, cy (absolute), b1, b2; the others have no unit."""

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
        """Whether the lens is decentred (without p1 and p2, p3 and p4 do nothing)."""
        return self.p1 != 0 or self.p2 != 0


def bent_forward(lens: Calibration, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """(x', y', Jacobian (2, 2, n)) of x, y (n,): the formulas at the head of this file."""
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
    """(n,) of a Jacobian (2, 2, n): positive where the lens does not fold."""
    return np.asarray(jacobian[0, 0] * jacobian[1, 1] - jacobian[0, 1] * jacobian[1, 0])


def straightened(
    lens: Calibration, bent_x: Array, bent_y: Array, limit: float
) -> tuple[Array, Array]:
    """x, y (n,) within the radius ``limit`` of x', y'; NaN where there is none."""
    guess = _radial_guess(lens.radial, limit, np.hypot(bent_x, bent_y))
    x, y = np.empty_like(bent_x), np.empty_like(bent_y)
    for start in range(0, len(bent_x), BLOCK):
        part = slice(start, start + BLOCK)
        x[part], y[part] = _unbent(lens, bent_x[part], bent_y[part], guess)
    with np.errstate(invalid="ignore"):
        beyond = ~(np.hypot(x, y) <= limit * (1 + 1e-12))
    x[beyond] = y[beyond] = np.nan
    return x, y


def _radial_guess(
    coefficients: tuple[float, float, float, float], limit: float, bent: Array
) -> Callable[[Array], Array]:
    """r of r' where only the radial terms act, by a table up to the fold."""
    finite = bent[np.isfinite(bent)]
    farthest = 1.05 * finite.max(initial=0.0) + 0.1
    k = np.array([0.0, 1.0, 0.0, coefficients[0], 0.0, coefficients[1], 0.0, coefficients[2], 0.0])
    k = np.append(k, coefficients[3])
    end = min(limit, 1.0)
    while end < limit and np.polynomial.polynomial.polyval(end, k) < farthest and end < 1e6:
        end = min(2 * end, limit)
    radii = np.linspace(0.0, end, TABLE)
    table = np.maximum.accumulate(np.polynomial.polynomial.polyval(radii, k))
    return lambda values: np.interp(values, table, radii)


def _unbent(
    lens: Calibration, bent_x: Array, bent_y: Array, guess: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """The x, y that the lens bends to these: Newton's method, its steps halved while they lead
    away; NaN where it does not arrive."""
    bent = np.hypot(bent_x, bent_y)
    with np.errstate(invalid="ignore", divide="ignore"):
        factor = np.where(bent > 0, guess(bent) / bent, 1.0)
    x, y = bent_x * factor, bent_y * factor
    active = np.flatnonzero(np.isfinite(bent))
    error = np.full_like(bent, np.inf)
    for _ in range(STEPS):
        now_x, now_y, jacobian = bent_forward(lens, x[active], y[active])
        off_x, off_y = now_x - bent_x[active], now_y - bent_y[active]
        error[active] = np.hypot(off_x, off_y)
        going = error[active] > EXACT * (1 + bent[active])
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
        share = (np.isfinite(step_x) & np.isfinite(step_y)).astype(float)
        step_x, step_y = np.nan_to_num(step_x), np.nan_to_num(step_y)
        for _ in range(6):
            with np.errstate(all="ignore"):
                to_x, to_y, _j = bent_forward(
                    lens, x[active] - share * step_x, y[active] - share * step_y
                )
                worse = ~(np.hypot(to_x - bent_x[active], to_y - bent_y[active]) <= error[active])
            if not worse.any():
                break
            share = np.where(worse, share / 2, share)
        x[active] -= share * step_x
        y[active] -= share * step_y
    _, _, jacobian = bent_forward(lens, x, y)
    with np.errstate(invalid="ignore"):
        lost = ~((error <= 1e-9 * (1 + bent)) & (determinant(jacobian) > 0))
    x[lost] = y[lost] = np.nan
    return x, y
