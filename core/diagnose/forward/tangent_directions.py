"""Directions in the tangent plane, which describe anisotropic reflection."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def tangential_half_vector(normal: Array, light: Array, view: Array) -> Array:
    """(n, 3) projection of the half vector onto the tangent plane; its length is sin θh. normal,
    light, view: (n, 3) unit."""
    half = light + view
    half = half / np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-9)
    return np.asarray(half - normal * np.sum(half * normal, axis=1, keepdims=True))


def tangential_axes(normal: Array) -> Array:
    """(n, 3, 3) projections of the scan's axes x, y, z onto the tangent plane; normal: (n, 3)
    unit."""
    return np.asarray(np.eye(3) - normal[:, :, None] * normal[:, None, :])
