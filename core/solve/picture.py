"""Convert a photo of any type to 8 bits per channel for feature detection."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from ..photo import read_radiance

Grey = NDArray[np.uint8]
WHITE_QUANTILE = 0.995  # fraction of the pixels below white, where the file has no upper bound
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # Rec. 709
CONTRAST, MEAN_GREY = 48.0, 128.0
SIGMA_FRACTION = 1 / 50  # the Gaussian's σ as a fraction of the longer side
NOISE_FLOOR = 20.0  # grey values; contrast far below it is noise and is not amplified


def read_picture(path: Path) -> NDArray[np.uint8]:
    """(h, w, 3) display pixels, sRGB curve, in the photo's own size, not rotated by its Exif.
    Raises InputError.

    Radiance without an upper bound (EXR, RAW …) is scaled so that the fraction WHITE_QUANTILE of it
    is below white.
    """
    radiance = read_radiance(path)
    np.nan_to_num(radiance, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
    step = max(1, radiance[..., 0].size // 1_000_000)
    white = float(np.quantile(radiance.max(axis=2).ravel()[::step], WHITE_QUANTILE))
    bounded = path.suffix.lower() in {".jpg", ".jpeg", ".png", ".tif", ".tiff"} and white <= 1.0
    scale = 1.0 if bounded or white <= 0 else 1.0 / white
    result = np.empty(radiance.shape, np.uint8)
    for top in range(
        0, len(radiance), 256
    ):  # in blocks, to avoid several copies of the whole photo
        part = np.clip(radiance[top : top + 256] * np.float32(scale), 0.0, 1.0)
        curve = np.where(part < 0.0031308, 12.92 * part, 1.055 * part ** (1 / 2.4) - 0.055)
        result[top : top + 256] = np.round(255.0 * curve)
    return result


def grey_of(picture: NDArray[np.uint8]) -> Grey:
    """(h, w) luma of display pixels."""
    return np.round(picture.astype(np.float32) @ LUMINANCE).astype(np.uint8)


def even_contrast(grey: Grey) -> Grey:
    """(h, w) the picture with equal mean and contrast in every neighbourhood. What remains is the
    fine texture of the surface, which a single lamp and light from all sides have in common."""
    values = grey.astype(np.float32)
    sigma = max(4.0, SIGMA_FRACTION * max(grey.shape))
    mean = gaussian_filter(values, sigma)
    spread = np.sqrt(np.maximum(gaussian_filter(values**2, sigma) - mean**2, 0.0))
    even = MEAN_GREY + CONTRAST * (values - mean) / (spread + NOISE_FLOOR)
    return np.clip(even, 0.0, 255.0).astype(np.uint8)
