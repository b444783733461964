"""A basis of principal components of measured reflectance (Ono et al. 2019, equations (1) and (2)).

The components are computed in training.py and components.py; equation (3) is in principal_brdf.py.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from . import mapping
from .grid import AngleGrid

CHUNK = 1 << 17  # directions evaluated at a time
MAX_CACHED_COPIES = 4  # of the nodes' first columns, up to 50 MB each
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Basis:
    """Mean, reference and scaled principal components on the nodes of an AngleGrid.

    mean: (n_h, n_d, n_p) float32, mean µ of the mapped observations.
    log_reference: the same shape, ln(ref + ε) (mapping.py).
    components: (k, n_h, n_d, n_p) float32, the scaled components Q = V·Σ; where there are
    ``others``, the last ones are those of residual_components.py.
    explained: fraction of variance of every component, including those not stored.
    columns: number of training observations (300 for the 100 MERL materials).
    provenance: data, command and licence from which the basis was computed.
    training: (columns, k) coefficients of the training columns, R, G and B of each material in
    turn; None where unknown.
    others: (m, k) the same of measured materials that are not among the training columns; None
    where there are none.
    """

    STORED_APART: ClassVar[bool] = True

    grid: AngleGrid
    mean: NDArray[np.float32]
    log_reference: NDArray[np.float32]
    components: NDArray[np.float32]
    explained: NDArray[np.float64]
    columns: int
    provenance: str
    training: NDArray[np.float64] | None = None
    others: NDArray[np.float64] | None = None

    def __getstate__(self) -> dict[str, Any]:
        """The fields, without what is computed from them."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def count(self) -> int:
        """k, the number of stored components."""
        return int(self.components.shape[0])

    @property
    def coefficient_variance(self) -> float:
        """Variance of the training coefficients, 1/columns by construction."""
        return 1.0 / self.columns

    @cached_property
    def version(self) -> str:
        """Short hash of mean, reference and components: identifies the basis that a result refers
        to."""
        digest = hashlib.sha256()
        for array in (self.mean, self.log_reference, self.components):
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()[:12]

    @cached_property
    def nodes(self) -> NDArray[np.float32]:
        """(grid.size, 1 + k): µ + ln(ref + ε), then the components; one row per node."""
        centre = (self.mean + self.log_reference).reshape(1, -1)
        flat = self.components.reshape(self.count, -1)
        return np.ascontiguousarray(np.concatenate([centre, flat]).T.astype(np.float32))

    @cached_property
    def _leading(self) -> dict[int, NDArray[np.float32]]:
        """Cache: number of columns → the first columns of nodes, contiguous."""
        return {}

    def leading_nodes(self, columns: int) -> NDArray[np.float32]:
        """(grid.size, columns) the first columns of nodes, contiguous: the centre, then the first
        components."""
        if columns == self.nodes.shape[1]:
            return self.nodes
        found = self._leading.get(columns)
        if found is None:
            if len(self._leading) >= MAX_CACHED_COPIES:
                self._leading.clear()
            found = self._leading[columns] = np.ascontiguousarray(self.nodes[:, :columns])
        return found

    def rows(
        self, angles: Angles, count: int | None = None
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Observed rows of the basis, equation (4): (centre (n,), Q̂ (n, count)) at n directions,
        with ln(ρ·cosMap + ε) = centre + Q̂ c."""
        k = self.count if count is None else min(count, self.count)
        values = self.grid.interpolate(self.leading_nodes(1 + k), angles)
        return values[:, 0], values[:, 1:]

    def mapped(self, rho: NDArray[np.floating], angles: Angles) -> NDArray[np.floating]:
        """Mapped, centred observations x̂ − µ̂ (n, c) of reflectances ρ (n, c) in 1/sr, the
        right-hand side of equation (4)."""
        centre, _ = self.rows(angles, 0)
        return mapping.log_weighted(rho, mapping.cos_map(angles)) - centre[:, None]

    def evaluate(self, coefficients: NDArray[np.floating], angles: Angles) -> NDArray[np.float32]:
        """ρ (..., c) in 1/sr of the BRDFs with coefficients (c, k), equation (3), at angles of any
        shape."""
        c = np.atleast_2d(np.asarray(coefficients, np.float32))
        shape = np.shape(angles.theta_h)
        flat = Angles(*(np.asarray(a).ravel() for a in np.broadcast_arrays(*angles)))
        out = np.empty((flat.theta_h.size, c.shape[0]), np.float32)
        for start in range(0, out.shape[0], CHUNK):
            part = Angles(*(a[start : start + CHUNK] for a in flat))
            centre, q = self.rows(part, c.shape[1])
            out[start : start + CHUNK] = mapping.unlog_weighted(
                centre[:, None] + q @ c.T, mapping.cos_map(part)
            )
        return out.reshape(*shape, c.shape[0])

    def project(
        self,
        rho: NDArray[np.floating],
        angles: Angles,
        count: int | None = None,
        eta: float = 0.0,
    ) -> NDArray[np.float64]:
        """Coefficients (c, k) that fit many reflectances ρ (n, c) in 1/sr by least squares (ridge
        parameter eta).

        The normal equations are summed over chunks, so memory does not grow with n.
        """
        k = self.count if count is None else min(count, self.count)
        gram, right = np.zeros((k, k)), np.zeros((k, rho.shape[1]))
        for start in range(0, rho.shape[0], CHUNK):
            part = Angles(*(a[start : start + CHUNK] for a in angles))
            centre, q = self.rows(part, k)
            target = mapping.log_weighted(rho[start : start + CHUNK], mapping.cos_map(part))
            q64 = q.astype(np.float64)
            gram += q64.T @ q64
            right += q64.T @ (target - centre[:, None])
        return np.linalg.solve(gram + eta * np.eye(k), right).T
