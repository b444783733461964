"""Decoder of the neural BRDF encodings of Sztrajman et al. 2021, "Neural BRDF Representation and
Importance Sampling". Used to compute the embedded basis and to test fits; no encoding is
distributed with Patina."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..errors import UNREADABLE_NPZ, InputError
from ..npz_file import open_npz

WEIGHTS = 675  # 6·21 + 21 + 21·21 + 21 + 21·3 + 3
MAX_BYTES = 1 << 26  # unpacked; the encodings of the MERL database have 0.3 MB


def load(path: Path) -> tuple[list[str], NDArray[np.float32]]:
    """(names, weights (n, 675)) from an .npz of encodings. Raises InputError for anything else."""
    try:
        with open_npz(path, MAX_BYTES) as data:
            names = [str(n) for n in data["names"]]
            weights = np.asarray(data["weights"]).astype(np.float32)
    except UNREADABLE_NPZ as error:
        raise InputError(f"not a set of neural BRDF encodings ({error})", file=path) from error
    if weights.shape != (len(names), WEIGHTS):
        raise InputError(
            f"weights of shape {weights.shape}; expected ({len(names)}, {WEIGHTS})", file=path
        )
    if not np.isfinite(weights).all():
        raise InputError("weights are not finite numbers", file=path)
    return names, weights


def evaluate(weights: NDArray[np.floating], angles: Angles) -> NDArray[np.float32]:
    """ρ in 1/sr, (..., 3), at half/difference angles in radians (any shape); weights: (675,)."""
    w = np.asarray(weights, np.float32)
    k1, b1 = w[:126].reshape(6, 21), w[126:147]
    k2, b2 = w[147:588].reshape(21, 21), w[588:609]
    k3, b3 = w[609:672].reshape(21, 3), w[672:675]
    th, td, pd = (np.asarray(a, np.float32) for a in np.broadcast_arrays(*angles))
    sd = np.sin(td)
    # the y component of the half vector is 0 by convention: row 1 of k1 is never used
    x = np.stack([np.sin(th), np.cos(th), sd * np.cos(pd), sd * np.sin(pd), np.cos(td)], axis=-1)
    x = np.maximum(x @ k1[[0, 2, 3, 4, 5]] + b1, 0)
    x = np.maximum(x @ k2 + b2, 0)
    return np.maximum(np.exp(x @ k3 + b3) - 1.0, 0.0)
