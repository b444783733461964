"""Oklab: a perceptually uniform colour space.

Ottosson, "A perceptual color space for image processing" (2020).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
_LEVEL = np.arange(256) / 255.0
LINEAR = np.where(  # IEC 61966-2-1
    _LEVEL <= 0.04045, _LEVEL / 12.92, ((_LEVEL + 0.055) / 1.055) ** 2.4
).astype(np.float32)


def oklab(srgb: NDArray[np.uint8]) -> NDArray[np.float32]:
    """(n, 3) Oklab lightness (0…1), a, b of 8-bit sRGB colours (n, 3)."""
    cones = np.cbrt(LINEAR[srgb] @ TO_CONES.T.astype(np.float32))
    return np.asarray(cones @ TO_LAB.T.astype(np.float32))
