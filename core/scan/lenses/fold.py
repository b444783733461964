"""Where a lens's distortion polynomial folds back: what lies beyond never was in the photo.

A polynomial fitted to the angles a photo covers says nothing beyond them. Where r·L(r) stops
growing it turns round, and points far outside the photo would project into it: Metashape's
k3 = −1.7 of a 50 mm lens folds at 35° from the axis and is back in the picture at 45°.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# model → places of k1, k2, … among its parameters (COLMAP's models.h)
PERSPECTIVE = {
    "SIMPLE_RADIAL": (3,),
    "RADIAL": (3, 4),
    "OPENCV": (4, 5),
    "FULL_OPENCV": (4, 5, 8),
    "METASHAPE_FRAME": (3, 4, 5, 6),
}
FISHEYE = {
    "SIMPLE_RADIAL_FISHEYE": (3,),
    "RADIAL_FISHEYE": (3, 4),
    "OPENCV_FISHEYE": (4, 5, 6, 7),
    "THIN_PRISM_FISHEYE": (4, 5, 8, 9),
    "RAD_TAN_THIN_PRISM_FISHEYE": (4, 5, 6, 7, 8, 9),
    "METASHAPE_FISHEYE": (3, 4, 5, 6),
    "METASHAPE_EQUISOLID": (3, 4, 5, 6),
}
DENOMINATOR = {"FULL_OPENCV": (9, 10, 11)}


@lru_cache(maxsize=256)
def fold_radius(coefficients: tuple[float, ...], denominator: tuple[float, ...] = ()) -> float:
    """The least r > 0 at which r·L(r) stops growing, infinite where it never does.

    L(r) = (1 + k1 r² + k2 r⁴ + …) / (1 + d1 r² + …). The zero of the derivative, as a polynomial in
    s = r²: (N + 2sN')D − 2sND'.
    """
    over, under = np.array([1.0, *coefficients]), np.array([1.0, *denominator])
    polynomial = np.polynomial.polynomial
    twice = np.array([0.0, 2.0])
    slope = polynomial.polysub(
        polynomial.polymul(
            polynomial.polyadd(over, polynomial.polymul(twice, polynomial.polyder(over))), under
        ),
        polynomial.polymul(twice, polynomial.polymul(over, polynomial.polyder(under))),
    )
    turns = [_least_positive(slope), _least_positive(under)]  # growing, and finite
    return float(np.sqrt(min(turns)))


def beyond_fold(model: str, parameters: Sequence[float], cam_points: Array) -> NDArray[np.bool_]:
    """(n,) True for points (n, 3) in the camera's frame that lie beyond the fold of its lens.

    For all models without a radial polynomial: nowhere. Tangential terms are small against the
    radial ones and are left out.
    """
    places = PERSPECTIVE.get(model) or FISHEYE.get(model)
    if places is None:
        return np.zeros(len(cam_points), bool)
    fold = fold_radius(
        tuple(float(parameters[i]) for i in places),
        tuple(float(parameters[i]) for i in DENOMINATOR.get(model, ())),
    )
    if not np.isfinite(fold):
        return np.zeros(len(cam_points), bool)
    across, z = np.hypot(cam_points[:, 0], cam_points[:, 1]), cam_points[:, 2]
    if model in PERSPECTIVE:
        return np.asarray(across > fold * z)
    angle = np.arctan2(across, z)
    radius = 2 * np.sin(angle / 2) if model == "METASHAPE_EQUISOLID" else angle
    return np.asarray(radius > fold)


def _least_positive(coefficients: Array) -> float:
    """The least positive root of 1 + c1 s + c2 s² + …; infinite where there is none."""
    try:
        # in 1/s the leading coefficient is 1, and the root wanted is the largest, the best known
        with np.errstate(all="ignore"):
            roots = np.roots(coefficients)
    except (np.linalg.LinAlgError, ValueError):  # beyond all bounds
        return np.inf
    real = roots.real[(np.abs(roots.imag) <= 1e-8 * np.abs(roots)) & (roots.real > 1e-12)]
    return float(1.0 / real.max(initial=0.0)) if len(real) else np.inf
