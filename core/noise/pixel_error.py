"""The variance of one pixel's radiance L about a prediction, whatever is predicted:

    var(L) = photo noise + (PROPORTIONAL_ERROR · L)² + (STRAY_LIGHT · bright)²

It is the part that the fit and the diagnosis have in common. The fit divides it by the number of
samples of a cell and adds what the samples of a cell share: the errors of the basis
(basis_error.py) and of the normals (fit/measured/posterior.py). The diagnosis adds what a single
pixel is subject to: the errors of the normals and of the camera pose, and the other side of a
shadow edge (diagnose/solver/residual_scale.py). Exposures of a bracket differ by photo noise alone,
because the other terms are the same in all of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Of the radiance. Sensors differ by about 1 % from pixel to pixel (photo response non-uniformity,
# EMVA 1288); interpolation in the basis adds 1 % (`run.py bench basis`, to 80°).
PROPORTIONAL_ERROR = 0.015
# Of the bright parts of the photo: light scattered in the lens where the diagnosis finds no veil.
# Assumed, not measured; it matters for parts that are a hundredth as bright.
STRAY_LIGHT = 0.004
BRIGHT_PERCENTILE = 90.0  # of a photo's radiance; a higher one would depend on a few highlights


def bright_parts(radiance: NDArray, photo: NDArray[np.integer]) -> NDArray[np.float64]:
    """(p,) the radiance of the bright parts of each photo, 0 of photos without pixels. radiance:
    (n,) grey, of n pixels of the photos (n,), numbered below p."""
    count = np.bincount(photo)
    ordered = radiance[np.argsort(photo, kind="stable")]
    out = np.zeros(len(count))
    for place, own in enumerate(np.split(ordered, np.cumsum(count)[:-1])):
        if len(own):
            out[place] = np.percentile(own, BRIGHT_PERCENTILE)
    return out


def pixel_variance(
    photo_noise: NDArray[np.floating], radiance: NDArray[np.floating], bright: NDArray[np.floating]
) -> NDArray[np.float64]:
    """(n, 3) variance of the radiance of n pixels.

    photo_noise: (n, 3) variance (photo_noise.py). radiance: (n, 3), predicted. bright: (n, 1), of
    the bright parts of the photo. All in one unit.
    """
    return np.asarray(
        photo_noise.astype(np.float64)
        + (PROPORTIONAL_ERROR * radiance) ** 2
        + (STRAY_LIGHT * bright) ** 2
    )
