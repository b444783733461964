"""Convert linear RGB of other primaries to linear Rec.709 (the primaries of sRGB), white D65."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
ADOBE_RGB = (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290)
D50_XYZ = np.array([0.9642, 1.0, 0.8249])  # the ICC profile connection space
# cone responses of the linear Bradford transform (ICC.1:2022, annex E)
BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)
IDENTITY_TOLERANCE = 4e-3  # per element of the matrix: sRGB profiles differ by as much


def xyz_from_rgb(chromaticities: tuple[float, ...]) -> Matrix:
    """(3, 3) matrix from linear RGB to XYZ.

    chromaticities: 8 numbers, x and y of red, green, blue and white. White (1, 1, 1) has Y = 1.
    Raises ValueError where no such matrix exists.
    """
    xy = np.asarray(chromaticities, float).reshape(4, 2)
    if not np.isfinite(xy).all() or (np.abs(xy) > 10).any() or (np.abs(xy[:, 1]) < 1e-6).any():
        raise ValueError("impossible chromaticities")
    xyz = np.stack([xy[:, 0] / xy[:, 1], np.ones(4), (1 - xy.sum(axis=1)) / xy[:, 1]])
    try:
        scale = np.linalg.solve(xyz[:, :3], xyz[:, 3])
    except np.linalg.LinAlgError as error:
        raise ValueError("the primaries lie on one line") from error
    return np.asarray(xyz[:, :3] * scale)


def adapt(source_white: Matrix, target_white: Matrix) -> Matrix:
    """(3, 3) matrix from XYZ under one white to XYZ under another: linear Bradford transform."""
    gain = (BRADFORD @ target_white) / (BRADFORD @ source_white)
    return np.asarray(np.linalg.inv(BRADFORD) @ np.diag(gain) @ BRADFORD)


def to_rec709(xyz_of_rgb: Matrix, white: Matrix) -> Matrix | None:
    """(3, 3) matrix to linear Rec.709 from linear RGB with the matrix ``xyz_of_rgb`` to XYZ and the
    white point ``white`` (XYZ).

    None where it is the identity up to IDENTITY_TOLERANCE. Raises ValueError for a singular matrix.
    """
    if not np.isfinite(xyz_of_rgb).all() or abs(np.linalg.det(xyz_of_rgb)) < 1e-6:
        raise ValueError("singular matrix of primaries")
    rec709 = xyz_from_rgb(REC709)
    matrix = np.linalg.inv(rec709) @ adapt(white, rec709.sum(axis=1)) @ xyz_of_rgb
    if np.abs(matrix - np.eye(3)).max() < IDENTITY_TOLERANCE:
        return None
    return np.asarray(matrix / matrix.sum(axis=1, keepdims=True))  # grey stays exactly grey


def from_chromaticities(chromaticities: tuple[float, ...]) -> Matrix | None:
    """to_rec709 for primaries given by chromaticities (see xyz_from_rgb). Raises ValueError for
    impossible ones."""
    matrix = xyz_from_rgb(chromaticities)
    return to_rec709(matrix, matrix.sum(axis=1))
