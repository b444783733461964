"""A basis on disk: fixed-point numbers, differenced along θh and φd, deflated.

A step of 0.01 in a scaled component is 0.0006 in log reflectance for a coefficient of typical size
(training coefficients have variance 1/300): far below the interpolation error.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import UNREADABLE_NPZ, InputError
from .basis import Basis
from .grid import AngleGrid

COMPONENT_STEP = 0.01
LOG_STEP = 0.0005
FORMAT = 1


def save(path: Path, basis: Basis) -> None:
    """Write a basis as .npz; the file appears whole or not at all."""
    partial = path.with_name(path.name + ".part")
    with open(partial, "wb") as file:
        np.savez_compressed(
            file,
            format=np.int32(FORMAT),
            grid=np.array([*basis.grid.shape, basis.grid.knee]),
            mean=_encode(basis.mean[None], LOG_STEP),
            log_reference=_encode(basis.log_reference[None], LOG_STEP),
            components=_encode(basis.components, COMPONENT_STEP),
            explained=basis.explained.astype(np.float32),
            columns=np.int32(basis.columns),
            provenance=np.array(basis.provenance),
        )
    os.replace(partial, path)


def load(path: Path) -> Basis:
    """Read a basis written by :func:`save`. Raises InputError for anything else."""
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as data:
            if int(data["format"]) != FORMAT:
                raise InputError(
                    f"basis format {int(data['format'])}, expected {FORMAT}", file=path
                )
            n_h, n_d, n_p, knee = (float(x) for x in data["grid"])
            return Basis(
                grid=AngleGrid(int(n_h), int(n_d), int(n_p), knee),
                mean=_decode(data["mean"], LOG_STEP)[0],
                log_reference=_decode(data["log_reference"], LOG_STEP)[0],
                components=_decode(data["components"], COMPONENT_STEP),
                explained=data["explained"].astype(np.float64),
                columns=int(data["columns"]),
                provenance=str(data["provenance"]),
            )
    except UNREADABLE_NPZ as error:
        raise InputError(f"not a Patina basis ({error})", file=path) from error


def _encode(values: NDArray[np.floating], step: float) -> NDArray[np.int16]:
    """(c, n_h, n_d, n_p) → int16 second differences (they wrap; decoding wraps back)."""
    fixed = np.round(values / step).astype(np.int64)
    if np.abs(fixed).max() > 32767:
        raise ValueError("values exceed the range of the fixed-point step")
    return np.diff(np.diff(fixed, axis=1, prepend=0), axis=3, prepend=0).astype(np.int16)


def _decode(encoded: NDArray[np.int16], step: float) -> NDArray[np.float32]:
    summed = np.cumsum(encoded, axis=3, dtype=np.int16)
    return np.cumsum(summed, axis=1, dtype=np.int16).astype(np.float32) * np.float32(step)
