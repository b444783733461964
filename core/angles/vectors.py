"""Products of vectors along the last axis, component by component, and sets of unit vectors.

Products are written out instead of as a matrix product: the result of a row is then bit-identical
whatever rows it is computed with, and float32 stays float32.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]


def dot(a: Array, b: Array) -> Array:
    """(...) inner products of vectors (..., 3) that broadcast."""
    total: Array = a[..., 0] * b[..., 0]
    total += a[..., 1] * b[..., 1]
    total += a[..., 2] * b[..., 2]
    return total


def cross(a: Array, b: Array) -> tuple[Array, Array, Array]:
    """Components x, y, z, each (...), of the cross products of vectors (..., 3) that broadcast."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def tangents(axis: Array) -> tuple[Array, Array]:
    """Two unit vectors (n, 3) perpendicular to unit vectors (n, 3) and to each other, float64: axis
    = first × second."""
    helper = np.where(np.abs(axis[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(axis, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(axis, first)


def length(x: Array, y: Array, z: Array) -> Array:
    """(...) lengths of vectors given by their components."""
    total: Array = x * x
    total += y * y
    total += z * z
    return np.asarray(np.sqrt(total))


def even_directions(count: int) -> NDArray[np.float64]:
    """(count, 3) unit vectors spread evenly over the sphere, on a Fibonacci spiral."""
    k = np.arange(count)
    z, turn = 1 - (2 * k + 1) / count, np.pi * (3 - np.sqrt(5)) * k
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)
