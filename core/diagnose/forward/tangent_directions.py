"""Directions along the surface, by which what is brushed or woven is told from what is not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def tangential_half_vector(normal: Array, light: Array, view: Array) -> Array:
    """(n, 3) the part of the half vector that lies in the surface, sin θh long; unit vectors
    (n, 3)."""
    half = light + view
    half = half / np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-9)
    return np.asarray(half - normal * np.sum(half * normal, axis=1, keepdims=True))


def tangential_axes(normal: Array) -> Array:
    """(n, 3, 3) the parts of the scan's axes x, y, z that lie in the surface; normal: (n, 3)."""
    return np.asarray(np.eye(3) - normal[:, :, None] * normal[:, None, :])
