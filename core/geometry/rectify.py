"""Resample a photo from a distorted lens to a pinhole camera of the same pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from ..scan import Camera
from .lattice import Lattice

MAX_ERROR = 0.01  # pixels of the photo by which an interpolated place may be wrong


def rectify(pixels: NDArray[np.floating], camera: Camera, target: Camera) -> NDArray[np.float32]:
    """The photo (h, w, c) of ``camera`` resampled to the pinhole camera ``target``.

    Bilinear; 0 for directions outside the photo. Works in blocks of rows.
    """
    source, lens = camera.lens, target.lens

    def place(pixel: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, 2) column and row in the photo, from its first pixel, of (n, 2) target pixels."""
        normalised = np.asarray(lens.cam_from_img(pixel))
        return np.asarray(source.img_from_cam(np.c_[normalised, np.ones(len(pixel))])) - 0.5

    lattice = Lattice.of(target.width, target.height, place, MAX_ERROR)
    out = np.zeros((target.height, target.width, pixels.shape[2]), np.float32)
    step = max(1, (1 << 20) // target.width)
    for top in range(0, target.height, step):
        bottom = min(top + step, target.height)
        if lattice is None:
            rows, columns = np.mgrid[top:bottom, 0 : target.width]
            column, row = place(np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.5).T
        else:
            column, row = lattice.window(top, bottom, 0, target.width)
        for channel in range(pixels.shape[2]):
            values = map_coordinates(
                pixels[:, :, channel], [row, column], np.float32, order=1, mode="constant", cval=0.0
            )
            out[top:bottom, :, channel] = values.reshape(bottom - top, target.width)
    return out
