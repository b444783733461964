"""Measure the irradiance of a light from a photo of a matte target of known reflectance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scan.camera import Camera

Array = NDArray[np.float64]

MIN_PIXELS = 25  # of the target
BLOCKS = 5  # per side: correlated noise of neighbouring pixels shows only between blocks
OUTLIER_SIGMA = 4.0  # robust standard deviations: dust, scratches, a printed mark
MAX_UNEVENNESS = 0.05  # of the mean, from one side of the target to the other; more gives a note
MAX_CLIPPED_SHARE = 0.005  # of its pixels
PLATEAU = 0.995  # of the brightest value
MIN_COSINE = 0.1  # 84°: beyond it 1° of the target's tilt changes the irradiance by 20 %
MAX_REFLECTANCE = 1.2  # paper with optical brightener can be above 1


@dataclass(frozen=True)
class WhiteIrradiance:
    """Irradiance from a white target. irradiance: (3,) at normal incidence, radiance units × sr.
    standard_error: (3,) of it, only from noise and blotches of the target. unevenness: difference
    between two sides of the target, relative to the mean. notes: sentences for the user."""

    irradiance: Array
    standard_error: Array
    unevenness: float
    notes: tuple[str, ...]


def irradiance_from_white(
    pixels: NDArray,
    camera: Camera | None,
    region: NDArray,
    reflectance: float | Sequence[float],
    normal: Sequence[float] | NDArray | None = None,
    direction: Sequence[float] | NDArray | None = None,
    saturation: float | None = None,
) -> WhiteIrradiance:
    """Measure the irradiance at normal incidence of a distant light, E = π L / (ρ n·l), from a
    Lambertian target.

    pixels: (h, w, 3) linear radiance of the photo; camera: of the photo, None where it is not a
    camera of the scan (then it is not checked that the normal faces the camera). region: mask
    (h, w), white = target, or polygon (n, 2) in pixels. reflectance: hemispherical ρ, one number or
    one per channel. normal: (3,) of the target, scan frame; direction: (3,) surface → light; any
    length. Where one is missing, the target is assumed to face the light (n·l = 1), with a note.
    saturation: radiance from which a pixel is clipped; None: detected by a plateau.

    L is the radiance at the target's centre from a linear fit without outliers; the slope is
    reported as unevenness. Raises InputError for an invalid region and for a clipped, black or
    averted target.
    """
    light = np.asarray(pixels)
    if camera is not None and light.shape != (camera.height, camera.width, 3):
        raise InputError(
            f"the white target's photo is {light.shape[1]} × {light.shape[0]} pixels; expected "
            f"{camera.width} × {camera.height}, the size of its camera",
            key="white",
        )
    rho = _reflectance(reflectance)
    rows, columns = np.nonzero(_mask(region, (light.shape[0], light.shape[1])))
    if len(rows) < MIN_PIXELS:
        raise InputError(
            f"the white target covers {len(rows)} pixels; expected {MIN_PIXELS} or more",
            key="white",
        )
    values = light[rows, columns].astype(float)
    if not np.isfinite(values).all():
        raise InputError(
            "the white target has NaN or infinite pixels; expected finite numbers", key="white"
        )
    notes: list[str] = []
    notes += _check_clipping(values, saturation)
    cosine = _cosine(normal, direction, notes)
    if camera is not None:
        _check_facing(normal, camera, rows, columns)

    radiance, error, unevenness = _level(values, rows, columns)
    if not (radiance > 0).all():
        raise InputError(
            "the white target is black in a channel; expected light in all channels: check the "
            "photo and the region",
            key="white",
        )
    if unevenness > MAX_UNEVENNESS:
        notes.append(
            f"the white target is {100 * unevenness:.0f} % brighter on one side than on the other. "
            "Possible causes: a near lamp (its irradiance then differs on the object), vignetting, "
            "or a shadow."
        )
    factor = np.pi / (rho * cosine)
    return WhiteIrradiance(radiance * factor, error * factor, unevenness, tuple(notes))


def _reflectance(given: float | Sequence[float]) -> Array:
    """(3,) checked reflectance per channel."""
    try:
        rho = np.broadcast_to(np.asarray(given, float), (3,))
    except (TypeError, ValueError):
        rho = np.full(3, np.nan)
    if not ((rho > 0) & (rho <= MAX_REFLECTANCE)).all():
        raise InputError(
            f"is {given}; expected a number above 0 and up to 1.2, or three of them (R, G, B)",
            key="reflectance",
        )
    return rho


def _mask(region: NDArray, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """(h, w) pixels of a region that is given as mask or polygon."""
    given = np.asarray(region)
    if given.shape == shape:
        return given > 0.5 if given.dtype != bool else given
    if given.ndim == 2 and given.shape[1] == 2 and len(given) >= 3:
        return _polygon(given.astype(float), shape)
    raise InputError(
        f"the white target's region has the shape {given.shape}; expected a mask of the photo's "
        f"{shape[1]} × {shape[0]} pixels, or a polygon of three or more corners",
        key="white",
    )


def _polygon(corners: Array, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Pixels whose centre is inside, by the even-odd rule."""
    if not np.isfinite(corners).all():
        raise InputError(
            "a corner of the white target is NaN or infinite; expected finite pixels", key="white"
        )
    y = np.arange(shape[0])[:, None] + 0.5
    x = np.arange(shape[1])[None] + 0.5
    inside = np.zeros(shape, bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y0 != y1:
            crossed = (y0 <= y) != (y1 <= y)
            inside ^= crossed & (x < x0 + (y - y0) / (y1 - y0) * (x1 - x0))
    return inside


def _check_clipping(values: Array, saturation: float | None) -> list[str]:
    top = float(values.max())
    if saturation is None:
        exact = (values == top).any(axis=1).mean()
        # a plateau among other values is the sensor's limit; a constant value is clipped only if
        # it is the file's limit 1.0 (otherwise the image is synthetic, without noise)
        flat = exact > 0.2 and (np.ptp(values, axis=0).any() or top == 1.0)
        limit = PLATEAU * top if flat else np.inf
    else:
        limit = saturation
    share = float((values >= limit).any(axis=1).mean())
    if share > MAX_CLIPPED_SHARE:
        raise InputError(
            f"{100 * share:.1f} % of the white target's pixels are clipped; expected at most "
            "0.5 %: use a shorter exposure, or a part of the target that is not clipped",
            key="white",
        )
    return []


def _cosine(
    normal: Sequence[float] | NDArray | None,
    direction: Sequence[float] | NDArray | None,
    notes: list[str],
) -> float:
    """n·l of the target; 1 with a note where the normal or the direction is missing."""
    units = [
        None if vector is None else _unit(vector, key)
        for vector, key in ((normal, "normal"), (direction, "direction"))
    ]
    if units[0] is None or units[1] is None:
        missing = "normal of the white target" if units[0] is None else "direction of the light"
        notes.append(
            f"the {missing} is unknown, so the target is assumed to face the light (if it is "
            "turned by 20°, the irradiance is wrong by 6 %)."
        )
        return 1.0
    cosine = float(units[0] @ units[1])
    if cosine < MIN_COSINE:
        raise InputError(
            f"the white target is turned {np.degrees(np.arccos(cosine)):.0f}° from the light; "
            "expected less than 84°: check the sign of its normal",
            key="normal",
        )
    return cosine


def _unit(vector: Sequence[float] | NDArray, key: str) -> Array:
    values = np.asarray(vector, float)
    length = float(np.linalg.norm(values)) if values.shape == (3,) else 0.0
    if not (np.isfinite(length) and length > 0):
        raise InputError(f"is {vector}; expected three finite numbers, not all 0", key=key)
    return values / length


def _check_facing(
    normal: Sequence[float] | NDArray | None, camera: Camera, rows: NDArray, columns: NDArray
) -> None:
    if normal is None:
        return
    middle = np.array([[columns.mean() + 0.5, rows.mean() + 0.5]])
    if float(camera.rays(middle)[0] @ _unit(normal, "normal")) >= 0:
        raise InputError(
            "the white target's normal points away from its camera; expected it to face the "
            "camera: change its sign",
            key="normal",
        )


def _level(values: Array, rows: NDArray, columns: NDArray) -> tuple[Array, Array, float]:
    """((3,) radiance at the target's centre, (3,) its standard error, unevenness) from a robust
    linear fit."""
    y, x = (axis - axis.mean() for axis in (rows.astype(float), columns.astype(float)))
    reach = max(float(np.abs(x).max()), float(np.abs(y).max()), 1.0)
    design = np.stack([np.ones(len(x)), x / reach, y / reach], axis=1)
    kept = np.ones(len(x), bool)
    fit = np.zeros((3, 3))
    for _ in range(5):
        fit, *_ = np.linalg.lstsq(design[kept], values[kept], rcond=None)
        left = values - design @ fit
        spread = 1.4826 * np.median(np.abs(left[kept]), axis=0) + 1e-12 * np.abs(fit[0])
        inside = (np.abs(left) <= OUTLIER_SIGMA * spread).all(axis=1)
        # a target of constant value (synthetic, or 8-bit) has no spread to compare with
        kept = inside if inside.sum() >= 0.5 * len(x) else kept
    left = values - design @ fit
    height, width = np.ptp(y) + 1, np.ptp(x) + 1
    down = np.minimum((y - y.min()) / height * BLOCKS, BLOCKS - 1).astype(int)
    across = np.minimum((x - x.min()) / width * BLOCKS, BLOCKS - 1).astype(int)
    block = (down * BLOCKS + across)[kept]
    count = np.bincount(block, minlength=BLOCKS * BLOCKS)
    full = count > 0
    means = np.stack(
        [np.bincount(block, left[kept, c], BLOCKS * BLOCKS)[full] / count[full] for c in range(3)],
        axis=1,
    )
    error = means.std(axis=0, ddof=1) / np.sqrt(full.sum()) if full.sum() > 1 else np.zeros(3)
    grey = fit.mean(axis=1)
    run = abs(grey[1]) * np.ptp(x) / reach + abs(grey[2]) * np.ptp(y) / reach
    unevenness = float(run / max(abs(grey[0]), 1e-300))
    return fit[0], error, unevenness
