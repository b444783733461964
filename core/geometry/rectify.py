"""Resample a photo from a distorted lens to a pinhole camera of the same pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ..scan import Camera
from .lattice import Lattice

PIXELS_AT_A_TIME = 1 << 17
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
    out = np.empty((target.height, target.width, pixels.shape[2]), np.float32)
    step = max(1, PIXELS_AT_A_TIME // target.width)
    for top in range(0, target.height, step):
        bottom = min(top + step, target.height)
        if lattice is None:
            rows, columns = np.mgrid[top:bottom, 0 : target.width]
            column, row = place(np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.5).T
        else:
            column, row = lattice.window(top, bottom, 0, target.width)
        values = interpolated(pixels, row, column)
        out[top:bottom] = values.reshape(bottom - top, target.width, -1)
    return out


def interpolated(
    pixels: NDArray[np.floating], row: NDArray[np.floating], column: NDArray[np.floating]
) -> NDArray[np.float32]:
    """(n, c) bilinear values of a photo (h, w, c) at n places, counted from the centre of its first
    pixel; 0 beyond the centres of its border pixels. For three channels a sparse product takes
    less time than scipy.ndimage.map_coordinates."""
    height, width, channels = pixels.shape
    inside = (row >= 0) & (row <= height - 1) & (column >= 0) & (column <= width - 1)
    row, column = np.where(inside, row, 0), np.where(inside, column, 0)
    top = np.minimum(row.astype(np.int32), max(height - 2, 0))
    left = np.minimum(column.astype(np.int32), max(width - 2, 0))
    down, along = (row - top).astype(np.float32), (column - left).astype(np.float32)
    below, right = width * min(height - 1, 1), min(width - 1, 1)  # 0 where there is only one
    first = top * width + left
    index = np.stack([first, first + right, first + below, first + below + right], axis=1)
    level, low = inside * (1 - down), inside * down
    weight = np.stack([level * (1 - along), level * along, low * (1 - along), low * along], axis=1)
    starts = np.arange(0, 4 * len(row) + 1, 4, dtype=np.int32)
    matrix = csr_array(
        (weight.ravel().astype(np.float32), index.ravel(), starts),
        shape=(len(row), height * width),
    )
    return np.asarray(matrix @ pixels.reshape(-1, channels).astype(np.float32, copy=False))
