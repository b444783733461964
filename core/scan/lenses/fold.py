"""The radius at which a lens's distortion polynomial folds. Points beyond it were never in the
photo.

The polynomial is fitted to the angles that the photo covers and is not valid beyond them. Where
r·L(r) stops growing it turns back, and points far outside the photo would project into it. For
example, Metashape's k3 = −1.7 of a 50 mm lens folds at 35° from the axis and reaches the picture
again at 45°.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# model → indices of k1, k2, … in its parameters (COLMAP's models.h)
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
    """The smallest r > 0 at which r·L(r) stops growing; infinite where it always grows.

    L(r) = (1 + k1 r² + k2 r⁴ + …) / (1 + d1 r² + …). It is a zero of the derivative, a polynomial
    in s = r²: (N + 2sN')D − 2sND'.
    """
    numerator, denominator_polynomial = (
        np.array([1.0, *coefficients]),
        np.array([1.0, *denominator]),
    )
    polynomial = np.polynomial.polynomial
    two_s = np.array([0.0, 2.0])
    slope = polynomial.polysub(
        polynomial.polymul(
            polynomial.polyadd(numerator, polynomial.polymul(two_s, polynomial.polyder(numerator))),
            denominator_polynomial,
        ),
        polynomial.polymul(
            two_s, polynomial.polymul(numerator, polynomial.polyder(denominator_polynomial))
        ),
    )
    turns = [
        _smallest_positive(slope),
        _smallest_positive(denominator_polynomial),
    ]  # growing, and finite
    return float(np.sqrt(min(turns)))


def beyond_fold(model: str, parameters: Sequence[float], cam_points: Array) -> NDArray[np.bool_]:
    """(n,) True for points (n, 3) in the camera's frame that lie beyond the fold of its lens.

    False for all models without a radial polynomial. Tangential terms are ignored, because they are
    small compared with the radial ones.
    """
    indices = PERSPECTIVE.get(model) or FISHEYE.get(model)
    if indices is None:
        return np.zeros(len(cam_points), bool)
    fold = fold_radius(
        tuple(float(parameters[i]) for i in indices),
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


def _smallest_positive(coefficients: Array) -> float:
    """The smallest positive root of 1 + c1 s + c2 s² + …; infinite where there is none."""
    try:
        # in 1/s the leading coefficient is 1, and this root is the largest, hence most accurate
        with np.errstate(all="ignore"):
            roots = np.roots(coefficients)
    except (np.linalg.LinAlgError, ValueError):  # coefficients overflow
        return np.inf
    real = roots.real[(np.abs(roots.imag) <= 1e-8 * np.abs(roots)) & (roots.real > 1e-12)]
    return float(1.0 / real.max(initial=0.0)) if len(real) else np.inf
