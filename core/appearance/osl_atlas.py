"""The components of a basis as one picture, so that a shader can look them up.

Every azimuth φd of the grid is a block of (θh across, θd down) with a border one texel wide that
repeats its edge; blocks of all φd stand side by side, and rows of blocks hold four numbers each in
R, G, B, A. A bilinear lookup in two neighbouring blocks, blended, is exactly AngleGrid's trilinear
interpolation. Slots: 0 and 1 are the two halves of µ + ln(ref + ε), the components follow.

Half floats: the centre, split into a rounded value and its remainder, keeps 21 bits, the components
keep 11. What that does to ρ is asserted in tests/core/test_osl_atlas.py.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..basis import AngleGrid, Basis
from ..errors import InputError
from ..photo import write_exr

CENTRE_SLOTS = 2
BORDER = 1


def groups(count: int) -> int:
    """Rows of blocks that the centre and ``count`` components take, four slots a row."""
    return -(-(CENTRE_SLOTS + count) // 4)


def size(grid: AngleGrid, count: int) -> tuple[int, int]:
    """(width, height) of the atlas in texels."""
    return grid.n_p * (grid.n_h + 2 * BORDER), groups(count) * (grid.n_d + 2 * BORDER)


def texels(basis: Basis, count: int | None = None) -> NDArray[np.float16]:
    """(height, width, 4) float16, row 0 on top."""
    k = basis.count if count is None else min(count, basis.count)
    centre = (basis.mean + basis.log_reference).astype(np.float32)
    high = centre.astype(np.float16)
    low = (centre - high.astype(np.float32)).astype(np.float16)
    slots = np.zeros((4 * groups(k), *basis.grid.shape), np.float16)
    slots[0], slots[1] = high, low
    slots[CENTRE_SLOTS : CENTRE_SLOTS + k] = basis.components[:k]
    pad = [(0, 0), (BORDER, BORDER), (BORDER, BORDER), (0, 0)]
    bordered = np.pad(slots, pad, mode="edge")  # (slot, h, d, p)
    n_h, n_d, n_p = bordered.shape[1:]
    rows = bordered.reshape(-1, 4, n_h, n_d, n_p).transpose(0, 3, 4, 2, 1)  # (group, d, p, h, 4)
    return np.ascontiguousarray(rows.reshape(-1, n_p * n_h, 4))


def write(path: Path, basis: Basis, count: int | None = None) -> Path:
    """Write the atlas as an EXR of half floats; the file appears whole or not at all."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", file=path) from error
    write_exr(path, texels(basis, count), half=True)
    return path


def file_name(basis: Basis) -> str:
    """One file serves every material of a basis."""
    return f"patina_components_{basis.version}.exr"


def lookup(
    atlas: NDArray[np.floating], grid: AngleGrid, u: NDArray[np.floating], group: int
) -> NDArray[np.floating]:
    """(n, 4): what the shader reads at fractional nodes u (n, 3) = (θh, θd, φd); for the tests."""
    block_h, block_d = grid.n_h + 2 * BORDER, grid.n_d + 2 * BORDER
    p0 = np.minimum(np.floor(u[:, 2]).astype(int), grid.n_p - 1)
    blend = (u[:, 2] - p0)[:, None]
    out = []
    for p in (p0, (p0 + 1) % grid.n_p):
        out.append(_bilinear(atlas, p * block_h + BORDER + u[:, 0], group * block_d + 1 + u[:, 1]))
    return (1 - blend) * out[0] + blend * out[1]


def _bilinear(
    image: NDArray[np.floating], x: NDArray[np.floating], y: NDArray[np.floating]
) -> NDArray[np.floating]:
    """Between texel centres at whole numbers."""
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    f, g = (x - x0)[:, None], (y - y0)[:, None]
    wide = image.astype(np.float64)
    top = (1 - f) * wide[y0, x0] + f * wide[y0, x0 + 1]
    return (1 - g) * top + g * ((1 - f) * wide[y0 + 1, x0] + f * wide[y0 + 1, x0 + 1])
