"""The light's irradiance, from a photo of a matte target of known reflectance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scan.camera import Camera

Array = NDArray[np.float64]

FEWEST = 25  # pixels of the target
BLOCKS = 5  # each way: noise that neighbouring pixels share shows between blocks, not pixels
OUTLIER = 4.0  # robust standard deviations: dust, scratches, a printed mark
UNEVEN = 0.05  # of the mean, from one side of the target to the other
CLIPPED = 0.005  # of its pixels
PLATEAU = 0.995  # of the brightest value
LEAST_COSINE = 0.1  # 84°: beyond it a degree of the target's tilt is 20 % of irradiance
BRIGHTEST = 1.2  # reflectance: paper with optical brightener can be above 1


@dataclass(frozen=True)
class WhiteIrradiance:
    """irradiance: (3,) at normal incidence, radiance units × sr. standard_error: (3,) of it, from
    noise and blotches of the target alone. unevenness: share of the mean by which the target
    differs from side to side. notes: sentences for the user."""

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
    """E = π L / (ρ n·l): the irradiance at normal incidence of a distant light on a Lambertian
    target.

    pixels: (h, w, 3) linear radiance of the photo; camera: the one that took it, None where it is
    no camera of the scan (then nobody checks that the normal faces it). region: mask (h, w), white
    = target, or polygon (n, 2) in pixels. reflectance: ρ, hemispherical (0.9; or one a channel).
    normal: (3,) of the target, scan frame; direction: (3,) surface → light: any length. Where one
    is missing the target is taken to face the light, n·l = 1, and a note says so. saturation:
    radiance from which a pixel is clipped; guessed from a plateau where None.

    L is a mean without outliers, at the target's middle: a linear run of brightness is fitted and
    reported. Raises InputError: a region that is none, a clipped, black or averted target.
    """
    light = np.asarray(pixels)
    if camera is not None and light.shape != (camera.height, camera.width, 3):
        raise InputError(
            f"the white target's photo is {light.shape[1]} × {light.shape[0]} pixels, its camera "
            f"{camera.width} × {camera.height}",
            key="white",
        )
    rho = _reflectance(reflectance)
    rows, columns = np.nonzero(_mask(region, (light.shape[0], light.shape[1])))
    if len(rows) < FEWEST:
        raise InputError(
            f"the white target covers {len(rows)} pixels; expected {FEWEST} or more", key="white"
        )
    values = light[rows, columns].astype(float)
    if not np.isfinite(values).all():
        raise InputError("the white target holds NaN or infinite pixels", key="white")
    notes: list[str] = []
    notes += _check_clipping(values, saturation)
    cosine = _cosine(normal, direction, notes)
    if camera is not None:
        _check_facing(normal, camera, rows, columns)

    radiance, error, unevenness = _level(values, rows, columns)
    if not (radiance > 0).all():
        raise InputError("the white target is black in a channel", key="white")
    if unevenness > UNEVEN:
        notes.append(
            f"the white target is {100 * unevenness:.0f} % brighter on one side than on the other: "
            "a lamp that is near (then its irradiance is not the same on the object), vignetting, "
            "or a shadow"
        )
    factor = np.pi / (rho * cosine)
    return WhiteIrradiance(radiance * factor, error * factor, unevenness, tuple(notes))


def _reflectance(told: float | Sequence[float]) -> Array:
    try:
        rho = np.broadcast_to(np.asarray(told, float), (3,))
    except (TypeError, ValueError):
        rho = np.full(3, np.nan)
    if not ((rho > 0) & (rho <= BRIGHTEST)).all():
        raise InputError(
            f"is {told}; expected a number above 0 and up to 1, or three of them (R, G, B)",
            key="reflectance",
        )
    return rho


def _mask(region: NDArray, shape: tuple[int, int]) -> NDArray[np.bool_]:
    told = np.asarray(region)
    if told.shape == shape:
        return told > 0.5 if told.dtype != bool else told
    if told.ndim == 2 and told.shape[1] == 2 and len(told) >= 3:
        return _polygon(told.astype(float), shape)
    raise InputError(
        f"the white target's region has the shape {told.shape}; expected the photo's "
        f"{shape[1]} × {shape[0]} pixels as a mask, or a polygon of three or more corners",
        key="white",
    )


def _polygon(corners: Array, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Pixels whose centre is inside, by the even-odd rule."""
    if not np.isfinite(corners).all():
        raise InputError("a corner of the white target is no number", key="white")
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
        # a plateau among other values is the sensor's limit; the same value everywhere is it only
        # where that is the file's limit (else the picture is a made one, without noise)
        flat = exact > 0.2 and (np.ptp(values, axis=0).any() or top == 1.0)
        limit = PLATEAU * top if flat else np.inf
    else:
        limit = saturation
    share = float((values >= limit).any(axis=1).mean())
    if share > CLIPPED:
        raise InputError(
            f"{100 * share:.0f} % of the white target's pixels are clipped; expose it less, or "
            "give a part of it that is not",
            key="white",
        )
    return []


def _cosine(
    normal: Sequence[float] | NDArray | None,
    direction: Sequence[float] | NDArray | None,
    notes: list[str],
) -> float:
    told = [
        None if vector is None else _unit(vector, key)
        for vector, key in ((normal, "normal"), (direction, "direction"))
    ]
    if told[0] is None or told[1] is None:
        missing = "normal" if told[0] is None else "light's direction"
        notes.append(
            f"the white target's {missing} is not known: it is taken to face the light (20° off "
            "would be 6 % of irradiance)"
        )
        return 1.0
    cosine = float(told[0] @ told[1])
    if cosine < LEAST_COSINE:
        raise InputError(
            f"the white target is turned {np.degrees(np.arccos(cosine)):.0f}° from the light; "
            "expected less than 84° (is its normal's sign right?)",
            key="normal",
        )
    return cosine


def _unit(vector: Sequence[float] | NDArray, key: str) -> Array:
    told = np.asarray(vector, float)
    length = float(np.linalg.norm(told)) if told.shape == (3,) else 0.0
    if not (np.isfinite(length) and length > 0):
        raise InputError(f"is {vector}; expected three numbers, not all 0", key=key)
    return told / length


def _check_facing(
    normal: Sequence[float] | NDArray | None, camera: Camera, rows: NDArray, columns: NDArray
) -> None:
    if normal is None:
        return
    middle = np.array([[columns.mean() + 0.5, rows.mean() + 0.5]])
    if float(camera.rays(middle)[0] @ _unit(normal, "normal")) >= 0:
        raise InputError(
            "the white target's normal points away from the camera that sees it; turn its sign",
            key="normal",
        )


def _level(values: Array, rows: NDArray, columns: NDArray) -> tuple[Array, Array, float]:
    """((3,) mean radiance at the target's middle, (3,) its standard error, side-to-side share)."""
    y, x = (axis - axis.mean() for axis in (rows.astype(float), columns.astype(float)))
    reach = max(float(np.abs(x).max()), float(np.abs(y).max()), 1.0)
    design = np.stack([np.ones(len(x)), x / reach, y / reach], axis=1)
    kept = np.ones(len(x), bool)
    fit = np.zeros((3, 3))
    for _ in range(5):
        fit, *_ = np.linalg.lstsq(design[kept], values[kept], rcond=None)
        left = values - design @ fit
        spread = 1.4826 * np.median(np.abs(left[kept]), axis=0) + 1e-12 * np.abs(fit[0])
        inside = (np.abs(left) <= OUTLIER * spread).all(axis=1)
        # a target of one value throughout (made up, or 8-bit) has no spread to judge by
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
