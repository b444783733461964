"""Direct light on the scanned surface: L = ρ · E · max(n·l, 0), zero where shadowed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..basis import Basis, PrincipalBRDF
from ..samples import SampleTable

CHUNK = 1 << 16  # samples


def predict_radiance(brdf: PrincipalBRDF, table: SampleTable) -> NDArray[np.float32]:
    """(n, 3) radiance of every sample's pixel for one BRDF."""
    return brdf.evaluate(table.angles) * table.irradiance * table.cos_i[:, None]


def similarity_sums(
    basis: Basis, candidates: NDArray[np.floating], table: SampleTable
) -> NDArray[np.float64]:
    """(t,) cosine similarity between the photos and t candidate BRDFs (t, 3, k), over all samples
    and channels as one vector (Ono et al. 2019, section 3.4). Rows are weighted by the samples they
    represent. Works in chunks, so memory does not grow with n."""
    t = len(candidates)
    flat = candidates.reshape(3 * t, -1)
    dot, norm, seen = np.zeros(t), np.zeros(t), 0.0
    for start in range(0, len(table), CHUNK):
        part = slice(start, start + CHUNK)
        angles = Angles(*(a[part] for a in table.angles))
        rho = basis.evaluate(flat, angles).reshape(-1, t, 3)
        scale = table.irradiance[part].astype(np.float64) * table.cos_i[part, None]
        predicted = rho * scale[:, None, :]
        measured = table.radiance[part].astype(np.float64)
        size = np.sqrt(table.weight[part]).astype(np.float64)
        predicted *= size[:, None, None]
        measured *= size[:, None]
        dot += np.einsum("ntc,nc->t", predicted, measured)
        norm += np.einsum("ntc,ntc->t", predicted, predicted)
        seen += float(np.sum(measured**2))
    return dot / np.sqrt(np.maximum(norm * seen, 1e-300))
