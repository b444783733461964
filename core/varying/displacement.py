"""A height over the mesh whose slopes are the tilts of the normals at the nodes.

A surface that is displaced by d along its normal n has the normal n − ∇d, as long as its slopes are
small. The tilt t at the nodes therefore gives ∇d = −t. Tilts from photos are not exactly the slopes
of one height; the height is the one that minimises

    ∫ |∇d + t|² + d² / l²   over the surface,

linear on the small triangles between the nodes (the screened Poisson equation; Nehab, Rusinkiewicz,
Davis and Ramamoorthi 2005 combine measured positions and normals in this way). The length l ties
the height to the mesh: over longer ways the positions of the mesh are better than sums of slopes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import LinearOperator, cg

from ..errors import PatinaError
from ..scan import Mesh
from ..scan.mesh_formats.distinct import distinct_places
from .node_model import TILT
from .surface_grid import SurfaceGrid
from .varying_surface import VaryingSurface

Array = NDArray[np.float64]

TIED_EDGES = 4.0
"""Edges of the mesh in the length l. The tilt of cells four edges wide varies a quarter as much as
that of one edge (MAX_TILT in hierarchy.py): there the mesh is better known than the slopes."""
MIN_AREA = 1e-12  # of the median: smaller triangles have none
WELD = 1e-4  # spacings, within which two nodes are at one place
TOLERANCE = 1e-4  # of the residual of the linear equations, relative
MAX_ITERATIONS = 2000


def heights(surface: VaryingSurface) -> Array:
    """(n,) height of the surface over the mesh at the nodes, along the smooth normals, scan units.

    Raises PatinaError where the normals of the surface do not vary.
    """
    if not surface.parameters[:, TILT].any():
        raise PatinaError(
            "the normals of this result do not vary; expected a result of `fit --varying` in which "
            "the normals of a material vary"
        )
    grid = surface.grid
    points, tilt = grid.points(slice(None)), _tangential(surface)
    first, welded = _welded(grid)
    faces = welded[grid.small_faces]
    stiffness, mass, right = _equations(points[first], faces, tilt[first])
    matrix = stiffness + diags_array(mass / (TIED_EDGES * grid.mesh_edge) ** 2)
    diagonal = np.maximum(matrix.diagonal(), 1e-300)
    found, failed = cg(
        matrix,
        right,
        rtol=TOLERANCE,
        maxiter=MAX_ITERATIONS,
        M=LinearOperator(matrix.shape, lambda v: v / diagonal),
    )
    if failed:
        raise PatinaError(
            f"the height of the surface was not found in {MAX_ITERATIONS} iterations; the mesh "
            "may have faces without area"
        )
    return np.asarray(found[welded])


def displaced_mesh(surface: VaryingSurface) -> Mesh:
    """The mesh with a vertex at each node, moved by its height. It keeps the texture coordinates.
    Raises what ``heights`` raises."""
    grid = surface.grid
    rows = slice(None)
    vertices = grid.points(rows) + heights(surface)[:, None] * grid.normals(rows)
    return Mesh(vertices, grid.small_faces.astype(np.int32), uv=grid.small_uv())


def _welded(grid: SurfaceGrid) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """(first node of each place, (n,) the place of each node): the mesh may be split at seams of
    its texture, and has two nodes at one place there."""
    cells = grid.points(slice(None)) / (WELD * grid.spacing)
    return distinct_places(np.rint(cells))


def _tangential(surface: VaryingSurface) -> Array:
    """(n, 3) tilts along the surface."""
    tilt = surface.parameters[:, TILT].astype(np.float64)
    normal = surface.grid.normals(slice(None))
    return tilt - np.einsum("ij,ij->i", tilt, normal)[:, None] * normal


def integrable_tilts(grid: SurfaceGrid, height: Array) -> NDArray[np.float32]:
    """(n, 3) tilts −∇d of a height (n,) at the nodes, the mean over the triangles around each."""
    first, welded = _welded(grid)
    faces, height = welded[grid.small_faces], height[first]
    slope, area = _slopes(grid.points(first), faces)
    weighted = -area[:, None] * np.einsum("fac,fa->fc", slope, height[faces])
    total = np.maximum(np.bincount(faces.ravel(), np.repeat(area, 3), len(first)), 1e-300)
    sums = [np.bincount(faces.ravel(), np.repeat(axis, 3), len(first)) for axis in weighted.T]
    return (np.stack(sums, axis=1) / total[:, None])[welded].astype(np.float32)


def _equations(
    points: Array, faces: NDArray[np.integer], tilt: Array
) -> tuple[csr_array, Array, Array]:
    """(stiffness (n, n), mass (n,), right-hand side (n,)) of linear functions on triangles."""
    n = len(points)
    slope, area = _slopes(points, faces)
    product = np.einsum("fac,fbc->fab", slope, slope) * area[:, None, None]
    row, column = np.repeat(faces, 3, axis=1).ravel(), np.tile(faces, (1, 3)).ravel()
    stiffness = csr_array((product.ravel(), (row, column)), shape=(n, n))
    pull = -np.einsum("fac,fc->fa", slope, tilt[faces].mean(axis=1)) * area[:, None]
    right = np.bincount(faces.ravel(), pull.ravel(), n).astype(float)
    mass = np.bincount(faces.ravel(), np.repeat(area / 3, 3), n).astype(float)
    return stiffness, np.maximum(mass, 1e-300), right


def _slopes(points: Array, faces: NDArray[np.integer]) -> tuple[Array, Array]:
    """(gradients (f, 3, 3) of the linear functions that are 1 at one corner, areas (f,)), both 0
    for triangles without area."""
    corner = points[faces]
    opposite = np.stack([corner[:, (k + 2) % 3] - corner[:, (k + 1) % 3] for k in range(3)], axis=1)
    normal = np.cross(opposite[:, 1], opposite[:, 2])
    double = np.linalg.norm(normal, axis=1)
    thin = double < MIN_AREA * np.median(double)
    safe = np.where(thin, np.inf, double)[:, None, None]
    # the opposite edge turned inwards, over twice the area
    slope = np.cross(normal[:, None] / safe, opposite) / safe
    return np.asarray(slope), np.asarray(np.where(thin, 0.0, 0.5 * double))
