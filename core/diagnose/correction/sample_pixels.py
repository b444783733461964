"""The pixels of a fit's samples, in the form that the effects of a diagnosis need."""

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
from ..pixels.neighbourhood import Veil, photo_slopes
from ..pixels.pixel_selection import REACH

SIDE = 0.02  # of the object's size: weight of a difference of normals in the distance


def pixels_of_samples(
    table: SampleTable, material: int, capture: Capture, scan: Scan, photos: LitPhotos, read: bool
) -> Generator[float, None, Pixels]:
    """Pixels of samples (n,) of one material; yields the fraction done. read: whether photos are
    read for ``slope`` and ``veil``, which are 0 otherwise. ``turn``, ``step`` and ``block`` are
    always 0. Raises InputError for a photo that no longer exists."""
    n = len(table)
    x, y = np.zeros(n, np.float32), np.zeros(n, np.float32)
    slope, veil = np.zeros((n, 2, 3), np.float32), np.zeros((n, 2, 3), np.float32)
    photo_indices = np.unique(table.photo)
    for done, place in enumerate(photo_indices.tolist()):
        yield done / len(photo_indices)
        rows = np.flatnonzero(table.photo == place)
        camera = capture_data.camera_of(capture, scan, place)
        pixel = table.pixel[rows]
        x[rows], y[rows] = centred_coordinates(pixel, camera.width, camera.height)
        if read:
            radiance = photos.read(place).radiance
            slope[rows] = photo_slopes(radiance, pixel)
            veil[rows] = Veil.of(radiance).at(*np.divmod(pixel, radiance.shape[1]))
    return Pixels(
        photo=table.photo, material=np.full(n, material, np.int16), pixel=table.pixel, x=x, y=y,
        point=table.point, normal=table.normal, view=table.view, light=table.light,
        irradiance=table.irradiance, visible=np.ones(n, np.float32),
        edge=np.full(n, REACH, np.float32), curvature=table.curvature, observed=table.radiance,
        noise=np.full((n, 3), 1e-20, np.float32), slope=slope, veil=veil,
        background=np.full((n, 3, 3), np.nan, np.float32),
        turn=np.zeros((n, 2, 3), np.float32), step=np.zeros((n, 2, 3), np.float32),
        usable=np.ones(n, bool), block=np.zeros(n, np.int32),
    )  # fmt: skip


def nearest(pixels: Pixels, candidates: Pixels, size: float) -> NearestPixels:
    """For each pixel (n,) the nearest of ``candidates`` in the same photo (in another one if that
    has none), and the nearest on the surface, with the two sides of a thin wall separated. size: of
    the object, scan units."""
    return NearestPixels(
        _nearest(*(separated_positions(p.photo, p.x, p.y) for p in (candidates, pixels))),
        _nearest(*(_on_surface(p, size) for p in (candidates, pixels))),
    )


def _nearest(places: NDArray[np.floating], of: NDArray[np.floating]) -> NDArray[np.intp]:
    return np.asarray(cKDTree(places).query(of)[1], np.intp)


def _on_surface(pixels: Pixels, size: float) -> NDArray[np.float64]:
    return np.concatenate([pixels.point / size, SIDE * pixels.normal], axis=1)
