"""A basis on disk: fixed-point numbers, differenced along θh and φd, split into bytes, deflated.

A step of 0.01 in a scaled component is 0.0006 in log reflectance for a coefficient of typical size
(training coefficients have variance 1/300). The first components have this step, the many weaker
ones twice that: 0.003 log-relative RMS for all hundred, far below the interpolation error (0.008).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import UNREADABLE_NPZ, InputError
from ..files import atomic_path
from ..npz_file import open_npz
from .basis import Basis
from .grid import AngleGrid

COMPONENT_STEP, WEAK_STEP = 0.01, 0.02
FINE_COUNT = 10  # components with the finer step
LOG_STEP = 0.0005
TRAINING_STEP = 1e-4  # of the training coefficients, whose standard deviation is 0.06
FORMAT = 2
MAX_BYTES = 1 << 28  # unpacked; a basis of the MERL database has 24 MB

Steps = Sequence[float] | NDArray[np.floating]


def save(path: Path, basis: Basis) -> None:
    """Write a basis as .npz, atomically. Raises OSError."""
    steps = np.where(np.arange(basis.count) < FINE_COUNT, COMPONENT_STEP, WEAK_STEP)
    arrays: dict[str, NDArray[Any]] = {
        "format": np.array(FORMAT, np.int32),
        "grid": np.array([*basis.grid.shape, basis.grid.knee]),
        "mean": _encode(basis.mean[None], [LOG_STEP]),
        "log_reference": _encode(basis.log_reference[None], [LOG_STEP]),
        "components": _encode(basis.components, steps),
        "steps": steps,
        "explained": basis.explained.astype(np.float32),
        "columns": np.array(basis.columns, np.int32),
        "provenance": np.array(basis.provenance),
    }
    for name, known in (("training", basis.training), ("others", basis.others)):
        if known is not None:
            arrays[name] = np.round(known / TRAINING_STEP).astype(np.int32)
    with atomic_path(path) as partial, open(partial, "wb") as file:
        np.savez_compressed(file, **arrays)


def load(path: Path) -> Basis:
    """Read a basis written by :func:`save`, also by earlier versions (which kept no training
    coefficients). Raises InputError for anything else."""
    try:
        with open_npz(path, MAX_BYTES) as data:
            version = int(data["format"])
            if version not in (1, FORMAT):
                raise InputError(f"basis format {version}; expected {FORMAT} or 1", file=path)
            n_h, n_d, n_p, knee = (float(x) for x in data["grid"])
            components = data["components"]
            grid = AngleGrid(int(n_h), int(n_d), int(n_p), knee)
            decode = _decode if version == FORMAT else _decode_whole
            steps = data["steps"] if version == FORMAT else [COMPONENT_STEP] * len(components)
            basis = Basis(
                grid=grid,
                mean=decode(data["mean"], [LOG_STEP])[0],
                log_reference=decode(data["log_reference"], [LOG_STEP])[0],
                components=decode(components, steps),
                explained=data["explained"].astype(np.float64),
                columns=int(data["columns"]),
                provenance=str(data["provenance"]),
                training=data["training"] * TRAINING_STEP if "training" in data else None,
                others=data["others"] * TRAINING_STEP if "others" in data else None,
            )
    except UNREADABLE_NPZ as error:
        raise InputError(f"not a Patina basis ({error})", file=path) from error
    if (
        basis.mean.shape != grid.shape
        or basis.log_reference.shape != grid.shape
        or basis.components.shape[1:] != grid.shape
        or (basis.training is not None and basis.training.shape != (basis.columns, basis.count))
        or (basis.others is not None and basis.others.shape[1:] != (basis.count,))
    ):
        raise InputError("not a Patina basis (the arrays do not fit its grid)", file=path)
    return basis


def _encode(values: NDArray[np.floating], steps: Steps) -> NDArray[np.uint8]:
    """(c, n_h, n_d, n_p) → (2, c, n_h, n_d, n_p): low and high bytes of second differences modulo
    2¹⁶, zigzag-coded so that small differences of either sign are small numbers. Separated bytes
    deflate to one sixth less."""
    fixed = np.round(values / np.reshape(steps, (-1, 1, 1, 1))).astype(np.int64)
    if np.abs(fixed).max() > 32767:
        raise ValueError("values exceed the range of the fixed-point step")
    second = np.diff(np.diff(fixed, axis=1, prepend=0), axis=3, prepend=0).astype(np.int16)
    folded = ((second << 1) ^ (second >> 15)).view(np.uint16)
    return np.stack([(folded & 255).astype(np.uint8), (folded >> 8).astype(np.uint8)])


def _decode(encoded: NDArray[np.uint8], steps: Steps) -> NDArray[np.float32]:
    """The inverse of _encode."""
    if encoded.dtype != np.uint8 or encoded.ndim != 5 or len(encoded) != 2:
        raise ValueError("unexpected type or dimensions of an array")
    out = np.empty(encoded.shape[1:], np.float32)
    for i, (low, high, step) in enumerate(zip(*encoded, steps, strict=True)):
        folded = low | (high.astype(np.uint16) << 8)
        second = (folded >> 1).view(np.int16) ^ -(folded & 1).view(np.int16)
        out[i] = _summed(second, step)
    return out


def _decode_whole(encoded: NDArray[np.int16], steps: Steps) -> NDArray[np.float32]:
    """The same for format 1: second differences, not split into bytes."""
    if encoded.dtype != np.int16 or encoded.ndim != 4:
        raise ValueError("unexpected type or dimensions of an array")
    return np.stack([_summed(e, step) for e, step in zip(encoded, steps, strict=True)])


def _summed(second: NDArray[np.int16], step: float) -> NDArray[np.float32]:
    """(n_h, n_d, n_p) from second differences; the sums wrap around as the differences did."""
    summed = np.cumsum(second, axis=2, dtype=np.int16)
    return np.cumsum(summed, axis=0, dtype=np.int16).astype(np.float32) * np.float32(step)
