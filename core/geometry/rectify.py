"""Resample a photo from a distorted lens to a pinhole camera of the same pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from ..scan import Camera


def rectify(pixels: NDArray[np.floating], camera: Camera, target: Camera) -> NDArray[np.float32]:
    """The photo (h, w, c) of ``camera`` resampled to the pinhole camera ``target``.

    Bilinear; 0 for directions outside the photo. Works in blocks of rows.
    """
    source, lens = camera.lens, target.lens
    out = np.zeros((target.height, target.width, pixels.shape[2]), np.float32)
    columns = np.arange(target.width) + 0.5
    step = max(1, (1 << 20) // target.width)
    for top in range(0, target.height, step):
        rows = np.arange(top, min(top + step, target.height)) + 0.5
        grid = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
        normalised = np.asarray(lens.cam_from_img(grid))
        at = np.asarray(source.img_from_cam(np.c_[normalised, np.ones(len(grid))])) - 0.5
        for channel in range(pixels.shape[2]):
            values = map_coordinates(
                pixels[:, :, channel], [at[:, 1], at[:, 0]], order=1, mode="constant", cval=0.0
            )
            out[top : top + len(rows), :, channel] = values.reshape(len(rows), target.width)
    return out
