"""The MERL ``.binary`` format: three int32 (90, 90, 180), then float64, channel-major R, G, B.

Stored numbers are scaled per channel; negative values mark invalid cells (Matusik et al. 2003).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..angles import merl_grid
from ..errors import InputError
from ..files import atomic_path, regular_size
from .table import TabulatedBRDF

SCALE = np.array([1.0, 1.15, 1.66]) / 1500.0  # stored numbers → 1/sr, for R, G, B
HEADER = np.dtype("<i4")
VALUES = np.dtype("<f8")
CELLS = 90 * 90 * 180
SIZE = 12 + 3 * CELLS * 8  # bytes of a file


def read(path: Path) -> TabulatedBRDF:
    """The table in a ``.binary`` file, in 1/sr. Raises InputError for anything else."""
    try:
        size = regular_size(path)
        with open(path, "rb") as file:
            head = file.read(12)
            if len(head) < 12:
                raise InputError(f"{size} bytes: the file is truncated", file=path)
            dimensions = tuple(int(n) for n in np.frombuffer(head, HEADER))
            if dimensions != merl_grid.SHAPE:
                raise InputError(
                    f"dimensions {dimensions}; expected {merl_grid.SHAPE}: "
                    "not an isotropic MERL file",
                    file=path,
                )
            if size != SIZE:
                raise InputError(
                    f"{size} bytes; expected {SIZE}: the file is truncated or not a MERL file",
                    file=path,
                )
            raw = np.frombuffer(file.read(), VALUES).reshape(3, *merl_grid.SHAPE)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error
    if not np.isfinite(raw).all():
        raise InputError("contains values that are not finite", file=path)
    values = np.where(raw < 0, -1.0, raw * SCALE[:, None, None, None])
    return TabulatedBRDF(values.astype(np.float32))


def write(path: Path, table: TabulatedBRDF) -> None:
    """Write a table, atomically; invalid cells become -1. Raises OSError."""
    values = table.values.astype(np.float64)
    raw = np.where(values < 0, -1.0, values / SCALE[:, None, None, None])
    with atomic_path(path) as partial, open(partial, "wb") as file:
        file.write(np.array(merl_grid.SHAPE, HEADER).tobytes())
        file.write(raw.astype(VALUES).tobytes())
