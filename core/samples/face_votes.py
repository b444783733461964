"""Assign a material to each face by the masks of all photos that show it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..scan import Mesh


@dataclass
class FaceVotes:
    """counts: (materials, faces) number of pixels that show the face inside the material's mask."""

    counts: NDArray[np.int64]

    @classmethod
    def empty(cls, faces: int, materials: int) -> FaceVotes:
        """No votes yet."""
        return cls(np.zeros((materials, faces), np.int64))

    def add(self, material: int, faces: NDArray[np.int32]) -> None:
        """Count pixels (n,) that show these faces and lie in the material's mask."""
        self.counts[material] += np.bincount(faces, minlength=self.counts.shape[1])

    def winners(self, mesh: Mesh) -> NDArray[np.int32]:
        """(f,) the material with most votes; a face without votes takes that of its nearest
        neighbour with votes."""
        winners = self.counts.argmax(axis=0).astype(np.int32)
        voted = self.counts.sum(axis=0) > 0
        if voted.any() and not voted.all() and len(self.counts) > 1:
            centres = mesh.vertices[mesh.faces].mean(axis=1)
            _, nearest = cKDTree(centres[voted]).query(centres[~voted])
            winners[~voted] = winners[voted][nearest]
        return winners
