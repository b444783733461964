"""Simulated scans: variants of an exact mesh with a given median normal error, in degrees.

bumpy: vertices are moved along their normals by a smooth random field, fine or coarse, because the
errors of stereo are correlated between neighbours; blurred: details are smoothed, as refinement and
decimation do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from patina.core.scan import Mesh

from .shapes import waves

Array = NDArray[np.float64]

FINE, COARSE = 0.012, 0.06
"""Wavelengths of the bumps, as fractions of the diagonal of the bounding box."""


def normal_errors(vertices: Array, true: Mesh) -> Array:
    """Return (v,) angles in degrees between true normals and those of ``vertices``."""
    incidence = _incidence(true)
    before = _normals(true.vertices, true.faces, incidence)
    return _angle(_normals(vertices, true.faces, incidence), before)


def bumpy(true: Mesh, degrees: float, wavelength: float = FINE, seed: int = 0) -> Mesh:
    """Add bumps of median normal error ``degrees``; wavelength: fraction of the mesh size."""
    field = waves(wavelength * true.size, 100 + seed)(true.vertices)
    moved = _bumps(true, true.vertices, field, degrees, 1e-3 * true.size * wavelength)
    return replace(true, vertices=moved)


def blurred(true: Mesh, degrees: float, seed: int = 0) -> Mesh:
    """Smooth until the median normal error is ``degrees``; add coarse bumps of a third of this."""
    average = _averaging(true)
    incidence = _incidence(true)
    normals = _normals(true.vertices, true.faces, incidence)

    def error(vertices: Array) -> float:
        return float(np.median(_angle(_normals(vertices, true.faces, incidence), normals)))

    before = after = true.vertices
    for _ in range(400):
        before = after
        for _ in range(5):
            after = after + 0.5 * (average @ after - after)
        if error(after) >= degrees:
            break
    low, high = error(before), error(after)
    part = np.clip((degrees - low) / max(high - low, 1e-9), 0, 1)
    smooth = before + part * (after - before)
    field = waves(COARSE * true.size, 200 + seed)(true.vertices)
    moved = _bumps(true, smooth, field, degrees / 3, 1e-3 * true.size * COARSE)
    return replace(true, vertices=moved)


def _bumps(mesh: Mesh, origin: Array, field: Array, degrees: float, start: float) -> Array:
    """Move ``origin`` along its normals such that the median normal error is ``degrees``.

    The amplitude is scaled iteratively by tan of the errors, which is almost linear in it.
    """
    incidence = _incidence(mesh)
    normals = _normals(origin, mesh.faces, incidence)
    amplitude = start
    for _ in range(8):
        moved = origin + amplitude * field[:, None] * normals
        error = float(np.median(_angle(_normals(moved, mesh.faces, incidence), normals)))
        if abs(error - degrees) < 0.01 * degrees:
            break
        amplitude *= np.tan(np.radians(degrees)) / np.tan(np.radians(min(error, 60.0)))
    return np.asarray(origin + amplitude * field[:, None] * normals)


def _incidence(mesh: Mesh) -> csr_matrix:
    """Return the (v, f) matrix that is 1 where a face contains a vertex."""
    rows = mesh.faces.ravel()
    columns = np.repeat(np.arange(len(mesh.faces)), 3)
    return csr_matrix((np.ones(len(rows)), (rows, columns)), (len(mesh.vertices), len(mesh.faces)))


def _normals(vertices: Array, faces: NDArray[np.int32], incidence: csr_matrix) -> Array:
    """Return (v, 3) area-weighted normals: faster than Patina's, equal on uniform triangles."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    total = incidence @ np.cross(b - a, c - a)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300))


def _angle(a: Array, b: Array) -> Array:
    sine = np.linalg.norm(np.cross(a, b), axis=1)
    return np.degrees(np.arctan2(sine, np.einsum("ij,ij->i", a, b)))


def _averaging(mesh: Mesh) -> csr_matrix:
    """Return the (v, v) matrix that averages over the neighbours of each vertex."""
    a, b = mesh.faces.ravel(), np.roll(mesh.faces, 1, axis=1).ravel()
    n = len(mesh.vertices)
    rows, columns = np.concatenate([a, b]), np.concatenate([b, a])
    links = csr_matrix((np.ones(len(rows)), (rows, columns)), (n, n))
    links.data[:] = 1.0
    degree = np.maximum(np.asarray(links.sum(axis=1)).ravel(), 1.0)
    return csr_matrix(links.multiply(1.0 / degree[:, None]))


def make(kind: str) -> Callable[[Mesh, float, int], Mesh]:
    """Return the function (mesh, median normal error in degrees, seed) → simulated scan.

    kind: "bumpy" (fine bumps), "wavy" (coarse bumps) or "blurred".
    """
    if kind == "blurred":
        return blurred
    wavelength = {"bumpy": FINE, "wavy": COARSE}[kind]
    return lambda true, degrees, seed: bumpy(true, degrees, wavelength, seed)
