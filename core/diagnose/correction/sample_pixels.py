"""The pixels of a fit's samples, as a diagnosis' effects want them."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...capture import Capture
from ...inputs import capture_data
from ...inputs.photos import LitPhotos
from ...samples import SampleTable
from ...scan import Scan
from ..forward.diagnosis_context import NearestPixels
from ..forward.pixels import Pixels
from ..pixels.image_cells import centred_coordinates, separated_positions
from ..pixels.pixel_selection import REACH, photo_slopes, photo_veil

SIDE = 0.02  # of the object's size, that surfaces at right angles count as farther apart


def pixels_of_samples(
    table: SampleTable, material: int, capture: Capture, scan: Scan, photos: LitPhotos, read: bool
) -> Generator[float, None, Pixels]:
    """Of every sample (n,), all of one material; yields the fraction done. read: whether photos
    are, for ``slope`` and ``veil``, which are 0 otherwise, as ``turn``, ``step`` and ``block``
    always are.
    Raises InputError for a photo that is no longer there."""
    n = len(table)
    x, y = np.zeros(n, np.float32), np.zeros(n, np.float32)
    slope, veil = np.zeros((n, 2, 3), np.float32), np.zeros((n, 2, 3), np.float32)
    numbers = np.unique(table.photo)
    for done, place in enumerate(numbers.tolist()):
        yield done / len(numbers)
        rows = np.flatnonzero(table.photo == place)
        camera = capture_data.camera_of(capture, scan, place)
        pixel = table.pixel[rows]
        x[rows], y[rows] = centred_coordinates(pixel, camera.width, camera.height)
        if read:
            radiance = photos.read(place).radiance
            slope[rows] = photo_slopes(radiance, pixel)
            veil[rows] = photo_veil(radiance, pixel)
    return Pixels(
        photo=table.photo, material=np.full(n, material, np.int16), pixel=table.pixel, x=x, y=y,
        point=table.point, normal=table.normal, view=table.view, light=table.light,
        irradiance=table.irradiance, visible=np.ones(n, np.float32),
        edge=np.full(n, REACH, np.float32), curvature=table.curvature, observed=table.radiance,
        noise=np.full((n, 3), 1e-20, np.float32), slope=slope, veil=veil,
        turn=np.zeros((n, 2, 3), np.float32), step=np.zeros((n, 2, 3), np.float32),
        usable=np.ones(n, bool), block=np.zeros(n, np.int32),
    )  # fmt: skip


def nearest(pixels: Pixels, looked_at: Pixels, size: float) -> NearestPixels:
    """Of each pixel (n,) those of the others that are nearest in the same photo (where it has none,
    in another one) and on the surface, the two sides of a thin wall apart; size: of the object."""
    return NearestPixels(
        _nearest(*(separated_positions(p.photo, p.x, p.y) for p in (looked_at, pixels))),
        _nearest(*(_on_surface(p, size) for p in (looked_at, pixels))),
    )


def _nearest(places: NDArray[np.floating], of: NDArray[np.floating]) -> NDArray[np.intp]:
    return np.asarray(cKDTree(places).query(of)[1], np.intp)


def _on_surface(pixels: Pixels, size: float) -> NDArray[np.float64]:
    return np.concatenate([pixels.point / size, SIDE * pixels.normal], axis=1)
