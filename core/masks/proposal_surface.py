"""The mesh as a graph of faces: patches, adjacency and smooth labels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..scan import Mesh

Array = NDArray[np.float64]
# weight of normals against positions, in sizes of the object, so that faces back to back belong to
# different patches
NORMAL_WEIGHT = 0.15


@dataclass(frozen=True)
class Surface:
    """Geometry and adjacency of f faces. centre, normal: (f, 3); area: (f,), sum 1; neighbours: (f,
    f) sparse, 1 where two faces share an edge; size: of the mesh, scan units."""

    centre: Array
    normal: Array
    area: Array
    neighbours: csr_array
    size: float

    @classmethod
    def of(cls, mesh: Mesh) -> Surface:
        """The graph of a mesh's faces."""
        corners = mesh.vertices[mesh.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1)
        return cls(
            corners.mean(axis=1),
            normal / np.maximum(length, 1e-300)[:, None],
            length / max(float(length.sum()), 1e-300),
            _face_neighbours(mesh),
            mesh.size,
        )

    def patches(self, count: int, seed: int = 0) -> NDArray[np.int32]:
        """(f,) the patch of each face: about ``count`` compact patches of similar area."""
        rng = np.random.default_rng(seed)
        place = np.concatenate([self.centre, NORMAL_WEIGHT * self.size * self.normal], axis=1)
        some = rng.choice(
            len(place), min(8 * count, len(place)), replace=False, p=_probabilities(self.area)
        )
        centres = _far_apart(place[some], count)
        _, patch = cKDTree(place[some][centres]).query(place)
        _, patch = np.unique(patch, return_inverse=True)
        return patch.ravel().astype(np.int32)

    def joined(self, patch: NDArray[np.int32]) -> csr_array:
        """(p, p) sparse: number of mesh edges between each two different patches."""
        edges = self.neighbours.tocoo()
        a, b = patch[edges.coords[0]], patch[edges.coords[1]]
        apart = a != b
        count = int(patch.max()) + 1
        ones = np.ones(int(apart.sum()))
        return csr_array((ones, (a[apart], b[apart])), shape=(count, count))


def _probabilities(area: Array) -> Array:
    """(f,) sampling probabilities: proportional to the area, with a lower bound."""
    kept = np.maximum(area, 1e-3 / len(area))
    return np.asarray(kept / kept.sum())


def _far_apart(points: Array, count: int) -> NDArray[np.intp]:
    """Indices of points (n, d) with a minimum distance between them (blue noise, by dart throwing);
    all of them if there are at most ``count``."""
    if len(points) <= count:
        return np.arange(len(points))
    tree = cKDTree(points)
    near = np.median(tree.query(points, k=min(9, len(points)))[0][:, -1])
    taken = np.zeros(len(points), bool)
    selected = []
    for i in range(len(points)):
        if not taken[i]:
            selected.append(i)
            taken[tree.query_ball_point(points[i], 1.3 * near)] = True
    return np.array(selected)


def _face_neighbours(mesh: Mesh) -> csr_array:
    """(f, f) sparse adjacency of the faces by shared edges."""
    n, v = len(mesh.faces), len(mesh.vertices)
    ends = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64), axis=1)
    key = ends[:, 0] * v + ends[:, 1]
    order = np.argsort(key, kind="stable")
    same = key[order][1:] == key[order][:-1]
    a, b = order[:-1][same] // 3, order[1:][same] // 3
    ones = np.ones(2 * len(a), np.float32)
    found = csr_array((ones, (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n))
    found.sum_duplicates()
    return found


def spread(values: Array, neighbours: csr_array, rounds: int) -> Array:
    """Values (n, k) averaged over neighbourhoods that grow by one ring of faces in each round."""
    degree = 1.0 + np.asarray(neighbours.sum(axis=1)).ravel()
    for _ in range(rounds):
        values = (values + neighbours @ values) / degree[:, None]
    return values


def smooth_labels(
    likelihood: Array, neighbours: csr_array, weight: float, rounds: int = 8
) -> NDArray[np.int32]:
    """(n,) smooth labels from log likelihoods (n, k).

    Potts model, iterated conditional modes (Besag 1986): the score of a label is its log likelihood
    plus ``weight`` times the share of neighbours with this label.
    """
    n, k = likelihood.shape
    labels = likelihood.argmax(axis=1)
    degree = np.maximum(np.asarray(neighbours.sum(axis=1)).ravel(), 1e-9)
    shares = diags_array(1.0 / degree) @ neighbours
    for turn in range(rounds):
        one_hot = np.zeros((n, k))
        one_hot[np.arange(n), labels] = 1.0
        better = (likelihood + weight * (shares @ one_hot)).argmax(axis=1)
        if turn % 2:  # simultaneous updates may oscillate: in every other round only half change
            better = np.where(np.arange(n) % 2, better, labels)
        if (better == labels).all():
            break
        labels = better
    return labels.astype(np.int32)


def without_islands(
    labels: NDArray[np.int32], surface: Surface, smallest: float
) -> NDArray[np.int32]:
    """Labels in which each connected piece smaller than ``smallest`` (share of the area) has taken
    the material that it shares most edges with; pieces without neighbours stay."""
    labels = labels.copy()
    edges = surface.neighbours.tocoo()
    a, b = edges.coords
    for _ in range(3):
        inner = labels[a] == labels[b]
        ones = np.ones(int(inner.sum()))
        n = len(labels)
        graph = csr_array((ones, (a[inner], b[inner])), shape=(n, n))
        count, piece = connected_components(graph, directed=False)
        area = np.bincount(piece, surface.area, count)
        small = area < smallest
        border = ~inner & small[piece[a]] & (area[piece[b]] > area[piece[a]])
        if not border.any():
            break
        votes = np.zeros((count, int(labels.max()) + 1))
        np.add.at(votes, (piece[a[border]], labels[b[border]]), 1.0)
        moved = small & (votes.sum(axis=1) > 0)
        labels = np.where(moved[piece], votes.argmax(axis=1)[piece], labels).astype(np.int32)
    return labels


def fill_hidden(labels: NDArray[np.int32], seen: NDArray[np.bool_], surface: Surface) -> None:
    """Give the faces that no photo shows the label of the nearest visible face, in place."""
    if seen.any() and not seen.all():
        _, nearest = cKDTree(surface.centre[seen]).query(surface.centre[~seen])
        labels[~seen] = labels[seen][nearest]
