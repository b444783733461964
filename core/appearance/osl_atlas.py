"""A BRDF as two pictures for lookup in a shader.

Every azimuth φd of the basis' grid is a block of (θh across, θd down) with a border one texel wide
that repeats its edge; the blocks of all φd are side by side. Bilinear lookups in two neighbouring
blocks, blended, are exactly AngleGrid's trilinear interpolation. This is linear in ln(ρ·cosMap +
ε), so a hundred components can be summed at the nodes once.

- The components' picture, one per basis: the first TRAITS components, whose coefficients are inputs
  of the shader. A row of blocks holds four of them in R, G, B, A, as half floats.
- The remainder's picture, one per material: the rest of the logarithm, R, G and B, as floats. It is
  the difference to the half floats themselves, so their rounding has no effect at the measured
  coefficients.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..basis import AngleGrid, Basis, PrincipalBRDF
from ..errors import InputError
from ..photo import write_exr

TRAITS = 8  # coefficients that are inputs of the shader
BORDER = 1  # texels
COMPONENTS_PREFIX, REMAINDER_PREFIX = "patina_components_", "patina_brdf_"
SAMPLING_PREFIX = "patina_sampling_"
NAME_PATTERN = re.compile(r"patina_(components|brdf|sampling)_[0-9a-f]{12}\.exr")
"""Matches every name that components_name, remainder_name and sampling_name generate."""
EXR_MAGIC = b"\x76\x2f\x31\x01"  # the first bytes of every OpenEXR file
MAX_FILE_BYTES = 1 << 27  # several times the largest picture of a basis on MERL's full angle grid


def is_own_name(name: object) -> bool:
    """Whether this is a file name that this module generates. Names from a .blend must be checked
    before they are joined to a folder: the pattern has no separator, drive or ".."."""
    return isinstance(name, str) and NAME_PATTERN.fullmatch(name) is not None


def traits(count: int) -> int:
    """How many of a BRDF's ``count`` coefficients are inputs of its shader."""
    return min(count, TRAITS)


def groups(count: int) -> int:
    """Rows of blocks for ``count`` components, four per row."""
    return -(-count // 4)


def size(grid: AngleGrid, rows: int) -> tuple[int, int]:
    """(width, height) in texels of a picture with so many rows of blocks."""
    return grid.n_p * (grid.n_h + 2 * BORDER), rows * (grid.n_d + 2 * BORDER)


def component_texels(basis: Basis) -> NDArray[np.float16]:
    """(height, width, 4) float16, row 0 at the top: the first components."""
    count = traits(basis.count)
    slots = np.zeros((4 * groups(count), *basis.grid.shape), np.float16)
    slots[:count] = basis.components[:count]
    return _blocks(slots, 4)


def remainder_texels(brdf: PrincipalBRDF) -> NDArray[np.float32]:
    """(height, width, 3) float32: ln(ρ·cosMap + ε) minus the contribution of the first
    components."""
    count = traits(brdf.coefficients.shape[1])
    first = brdf.basis.components[:count].astype(np.float16).reshape(count, -1).astype(np.float64)
    left = brdf.log_table.values.T - brdf.coefficients[:, :count] @ first
    return _blocks(left.astype(np.float32).reshape(3, *brdf.basis.grid.shape), 3)


def _blocks(slots: NDArray, channels: int) -> NDArray:
    """(slots, n_h, n_d, n_p) → texels, ``channels`` slots per row of blocks."""
    pad = [(0, 0), (BORDER, BORDER), (BORDER, BORDER), (0, 0)]
    bordered = np.pad(slots, pad, mode="edge")  # (slot, h, d, p)
    n_h, n_d, n_p = bordered.shape[1:]
    rows = bordered.reshape(-1, channels, n_h, n_d, n_p).transpose(0, 3, 4, 2, 1)
    return np.ascontiguousarray(rows.reshape(-1, n_p * n_h, channels))


def write_components(path: Path, basis: Basis) -> Path:
    """Write the components' picture, atomically. Raises InputError."""
    return write_picture(path, component_texels(basis), half=True)


def write_remainder(path: Path, brdf: PrincipalBRDF) -> Path:
    """Write the remainder's picture, atomically. Raises InputError."""
    return write_picture(path, remainder_texels(brdf))


def write_picture(path: Path, pixels: NDArray, half: bool = False) -> Path:
    """Write an EXR (height, width, channels), row 0 at the top, atomically. Raises InputError where
    the folder cannot be created."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", file=path) from error
    write_exr(path, pixels, half=half)
    return path


def components_name(basis: Basis) -> str:
    """File name of the components' picture: one file for all materials of a basis."""
    return f"{COMPONENTS_PREFIX}{basis.version}.exr"


def remainder_name(brdf: PrincipalBRDF) -> str:
    """File name of the remainder's picture, unique for every BRDF: renderers cache pictures by
    name."""
    return f"{REMAINDER_PREFIX}{_digest(brdf)}.exr"


def sampling_name(brdf: PrincipalBRDF) -> str:
    """File name of the picture of sampling_table.py, unique for every BRDF."""
    return f"{SAMPLING_PREFIX}{_digest(brdf)}.exr"


def _digest(brdf: PrincipalBRDF) -> str:
    """Hash of a BRDF: its basis and coefficients."""
    digest = hashlib.sha256(brdf.basis.version.encode())
    digest.update(np.ascontiguousarray(brdf.coefficients, np.float64).tobytes())
    return digest.hexdigest()[:12]


def lookup(
    atlas: NDArray[np.floating], grid: AngleGrid, u: NDArray[np.floating], group: int
) -> NDArray[np.floating]:
    """(n, channels): the value that the shader reads at fractional nodes u (n, 3) = (θh, θd, φd);
    for tests."""
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
    """Bilinear interpolation; texel centres are at whole numbers."""
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    f, g = (x - x0)[:, None], (y - y0)[:, None]
    wide = image.astype(np.float64)
    top = (1 - f) * wide[y0, x0] + f * wide[y0, x0 + 1]
    return (1 - g) * top + g * ((1 - f) * wide[y0 + 1, x0] + f * wide[y0 + 1, x0 + 1])
