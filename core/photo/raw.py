"""Camera RAW files, through the optional rawpy (LibRaw)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from ..errors import InputError
from .clipping import NEAR
from .container import check_size
from .primaries import REC709, Matrix, xyz_from_rgb

DEMOSAIC = "AHD"
REACH = 5  # pixels that one value of the mosaic can touch: AHD looks two to each side
MOST_BYTES = 1 << 30


@dataclass(frozen=True)
class Developed:
    """camera: (h, w, 3) uint16, white balanced, linear, 65535 = saturation of the channel with
    the smallest multiplier; clipped (h, w); matrix (3, 3) camera → Rec.709, None if unknown;
    white_balance (3,) multipliers used; saturation: in the camera's own numbers, above black."""

    camera: NDArray[np.uint16]
    clipped: NDArray[np.bool_]
    matrix: Matrix | None
    white_balance: tuple[float, float, float]
    saturation: float
    notes: tuple[str, ...]


def raw_size(path: Path) -> tuple[int, int]:
    """(width, height) as the sensor has it, not turned. Raises InputError."""
    with _opened(path) as raw:
        return raw.sizes.width, raw.sizes.height


def develop(path: Path) -> Developed:
    """Linear, black level off, camera white balance, no automatic brightness, full size, AHD, as
    the sensor lay (orientation not applied). Raises InputError."""
    with _opened(path) as raw:
        rawpy = _rawpy(path)
        try:
            raw.unpack()
            clipped, saturation = _clipped(raw)
            balance, notes = _white_balance(raw)
            pixels = raw.postprocess(
                rawpy.Params(
                    demosaic_algorithm=rawpy.DemosaicAlgorithm[DEMOSAIC],
                    user_wb=balance,
                    output_color=rawpy.ColorSpace.raw,
                    output_bps=16,
                    gamma=(1, 1),
                    no_auto_bright=True,
                    # else the brightest pixel of THIS photo would set its scale
                    adjust_maximum_thr=0.0,
                    highlight_mode=rawpy.HighlightMode.Clip,
                    user_flip=0,
                    half_size=False,
                )
            )
            matrix = _matrix(raw)
        except (rawpy.LibRawError, ValueError, RuntimeError, MemoryError) as error:
            raise InputError(
                f"is damaged, or of a kind not read ({_said(error)})", file=path
            ) from error
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise InputError("is no colour photo", file=path)
    if clipped is None or clipped.shape != pixels.shape[:2]:
        clipped = pixels.max(axis=2) >= NEAR * 65535
    if matrix is None:
        notes += ("the camera's colours are unknown to the RAW reader; they stay as they are",)
    used = np.array(balance[:3]) / min(balance[:3])
    return Developed(pixels, clipped, matrix, tuple(used.tolist()), saturation, notes)


def _said(error: BaseException) -> str:
    message = error.args[0] if error.args else ""
    text = message.decode("utf-8", "replace") if isinstance(message, bytes) else str(message)
    return " ".join(text.split())[:200]


def _rawpy(path: Path) -> Any:
    try:
        import rawpy
    except ImportError:
        raise InputError(
            "is a camera RAW file, and rawpy is not installed; develop it to a linear 16-bit TIFF, "
            "or install the build of Patina with RAW",
            file=path,
        ) from None
    return rawpy


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    if not path.is_file():
        raise InputError("is not a file" if path.exists() else "no such file", file=path)
    if path.stat().st_size > MOST_BYTES:
        raise InputError("is larger than a RAW file can sensibly be (1 GiB)", file=path)
    rawpy = _rawpy(path)
    raw = rawpy.RawPy()
    try:
        try:
            raw.open_file(str(path))
        except (rawpy.LibRawError, ValueError, RuntimeError, OSError) as error:
            raise InputError(
                f"is no RAW file that can be read ({_said(error)})", file=path
            ) from error
        sizes = raw.sizes
        check_size(path, sizes.width, sizes.height)
        check_size(path, sizes.raw_width, sizes.raw_height)
        yield raw
    finally:
        raw.close()


def _clipped(raw: Any) -> tuple[NDArray[np.bool_] | None, float]:
    """((h, w) pixels a saturated photosite can have touched, saturation above black)."""
    black = np.asarray(raw.black_level_per_channel, float)
    white = np.full(4, float(raw.white_level))
    stated = raw.camera_white_level_per_channel  # where the sensor stops being linear
    if stated is not None:
        stated = np.asarray(stated, float)[:4]
        white = np.where((stated > black) & (stated < white), stated, white)
    saturation = float((white - black).min())
    try:
        mosaic = raw.raw_image_visible
        pattern = raw.raw_colors_visible
    except (AttributeError, ValueError, RuntimeError):
        return None, saturation
    if mosaic is None or mosaic.ndim != 2 or pattern.shape != mosaic.shape:
        return None, saturation
    limit = (black + NEAR * (white - black)).astype(np.float32)
    hit = np.zeros(mosaic.shape, bool)
    for top in range(0, len(mosaic), 256):
        rows = slice(top, top + 256)
        hit[rows] = mosaic[rows] >= limit[np.minimum(pattern[rows], 3)]
    return maximum_filter(hit, REACH), saturation


def _white_balance(raw: Any) -> tuple[list[float], tuple[str, ...]]:
    """The multipliers the camera wrote, else those of daylight."""
    for multipliers, notes in (
        (raw.camera_whitebalance, ()),
        (raw.daylight_whitebalance, ("no white balance in the file; daylight is used",)),
    ):
        numbers = [float(m) for m in multipliers]
        if len(numbers) == 4 and np.isfinite(numbers).all() and min(numbers[:3]) > 0:
            return [*numbers[:3], numbers[3] if numbers[3] > 0 else numbers[1]], notes
    return [1.0] * 4, ("no white balance in the file; none is used",)


def _matrix(raw: Any) -> Matrix | None:
    """(3, 3) white balanced camera → linear Rec.709, as LibRaw's own conversion does it (after
    dcraw): camera of Rec.709, rows scaled so that white is white, inverted. A DNG's own colour
    matrix comes already so."""
    camera_of_xyz = np.asarray(raw.rgb_xyz_matrix, float)[:3]
    if camera_of_xyz.shape == (3, 3) and camera_of_xyz.any():
        camera_of_rgb = camera_of_xyz @ xyz_from_rgb(REC709)
        sums = camera_of_rgb.sum(axis=1, keepdims=True)
        if (np.abs(sums) < 1e-5).any() or abs(np.linalg.det(camera_of_rgb / sums)) < 1e-6:
            return None
        matrix = np.linalg.inv(camera_of_rgb / sums)
    else:
        matrix = np.asarray(raw.color_matrix, float)[:3, :3]
        if matrix.shape != (3, 3) or matrix[0, 0] < 0.125:
            return None
    return np.asarray(matrix) if np.isfinite(matrix).all() else None
