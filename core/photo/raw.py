"""Read camera RAW files with the optional package rawpy (LibRaw)."""

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
from .clipping import CLIPPING_LEVEL
from .container import check_size
from .primaries import REC709, Matrix, xyz_from_rgb

DEMOSAIC = "AHD"
AHD_SUPPORT = 5  # pixels that one photosite can affect: AHD uses two neighbours on each side
MAX_BYTES = 1 << 30


@dataclass(frozen=True)
class Developed:
    """A developed RAW.

    camera: (h, w, 3) uint16 in camera RGB, white balanced, linear; 65535 is the saturation of the
    channel with the smallest multiplier. clipped: (h, w). matrix: (3, 3) camera RGB → Rec.709, None
    if unknown. white_balance: (3,) multipliers used. saturation: in the camera's own units, above
    black. notes: sentences for the user.
    """

    camera: NDArray[np.uint16]
    clipped: NDArray[np.bool_]
    matrix: Matrix | None
    white_balance: tuple[float, float, float]
    saturation: float
    notes: tuple[str, ...]


def raw_size(path: Path) -> tuple[int, int]:
    """(width, height) in the sensor's orientation, not rotated. Raises InputError."""
    with _opened(path) as raw:
        return raw.sizes.width, raw.sizes.height


def develop(path: Path) -> Developed:
    """Develop a RAW: linear, black level subtracted, the camera's white balance, no automatic
    brightness, full size, demosaiced by AHD, orientation not applied. Raises InputError."""
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
                    # by default the brightest pixel of this photo would set the scale
                    adjust_maximum_thr=0.0,
                    highlight_mode=rawpy.HighlightMode.Clip,
                    user_flip=0,
                    half_size=False,
                )
            )
            matrix = _matrix(raw)
        except (rawpy.LibRawError, ValueError, RuntimeError, MemoryError) as error:
            raise InputError(
                f"is damaged or of an unsupported kind ({_message(error)}); develop it to a linear "
                "16-bit TIFF",
                file=path,
            ) from error
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise InputError("is not a colour photo; expected a RAW with three colours", file=path)
    if clipped is None or clipped.shape != pixels.shape[:2]:
        clipped = pixels.max(axis=2) >= CLIPPING_LEVEL * 65535
    if matrix is None:
        notes += ("the RAW reader does not know this camera's primaries; colours not converted.",)
    used = np.array(balance[:3]) / min(balance[:3])
    return Developed(pixels, clipped, matrix, tuple(used.tolist()), saturation, notes)


def _message(error: BaseException) -> str:
    """The text of an error in one line; LibRaw's are bytes."""
    message = error.args[0] if error.args else ""
    text = message.decode("utf-8", "replace") if isinstance(message, bytes) else str(message)
    return " ".join(text.split())[:200]


def _rawpy(path: Path) -> Any:
    try:
        import rawpy
    except ImportError:
        raise InputError(
            "is a camera RAW file, but rawpy is not installed; develop it to a linear 16-bit TIFF, "
            "or install the build of Patina with RAW support",
            file=path,
        ) from None
    return rawpy


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    if not path.is_file():
        raise InputError(
            "is not a file; expected a photo" if path.exists() else "no such file; check the path",
            file=path,
        )
    if path.stat().st_size > MAX_BYTES:
        raise InputError("is too large for a RAW file; expected at most 1 GiB", file=path)
    rawpy = _rawpy(path)
    raw = rawpy.RawPy()
    try:
        try:
            raw.open_file(str(path))
        except (rawpy.LibRawError, ValueError, RuntimeError, OSError) as error:
            raise InputError(
                f"is not a RAW file that LibRaw can read ({_message(error)}); develop it to a "
                "linear 16-bit TIFF",
                file=path,
            ) from error
        sizes = raw.sizes
        check_size(path, sizes.width, sizes.height)
        check_size(path, sizes.raw_width, sizes.raw_height)
        yield raw
    finally:
        raw.close()


def _clipped(raw: Any) -> tuple[NDArray[np.bool_] | None, float]:
    """((h, w) pixels that a saturated photosite can affect, saturation above black)."""
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
    limit = (black + CLIPPING_LEVEL * (white - black)).astype(np.float32)
    hit = np.zeros(mosaic.shape, bool)
    for top in range(0, len(mosaic), 256):
        rows = slice(top, top + 256)
        hit[rows] = mosaic[rows] >= limit[np.minimum(pattern[rows], 3)]
    return maximum_filter(hit, AHD_SUPPORT), saturation


def _white_balance(raw: Any) -> tuple[list[float], tuple[str, ...]]:
    """(multipliers of R, G, B, G2, notes): those that the camera wrote, otherwise daylight."""
    for multipliers, notes in (
        (raw.camera_whitebalance, ()),
        (raw.daylight_whitebalance, ("no white balance in the file; daylight is used.",)),
    ):
        values = [float(m) for m in multipliers]
        if len(values) == 4 and np.isfinite(values).all() and min(values[:3]) > 0:
            return [*values[:3], values[3] if values[3] > 0 else values[1]], notes
    return [1.0] * 4, ("no white balance in the file; none is applied.",)


def _matrix(raw: Any) -> Matrix | None:
    """(3, 3) matrix from white-balanced camera RGB to linear Rec.709, as in LibRaw (after dcraw):
    the matrix from Rec.709 to camera RGB, rows normalised so that white stays white, inverted. The
    colour matrix of a DNG already has this form."""
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
