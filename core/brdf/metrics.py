"""Error metrics between two BRDFs: that of the paper and two that agree better with perception."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, cosines, merl_grid
from ..errors import PatinaError
from .table import TabulatedBRDF

EPSILON = 1e-3  # 1/sr, as in Nielsen's mapping: smaller ρ·cosMap counts as black


@dataclass(frozen=True)
class Differences:
    """relative_l2: ‖truth − fit‖ / ‖truth‖ over all cells above the horizon (Ono et al. 2019, Fig.
    10; dominated by grazing angles). log_relative_rms: RMS of ln((fit·cosMap + ε)/(truth·cosMap +
    ε)) over light and view within ``limit`` degrees of the normal. cube_root_rms: RMS difference of
    (ρ·cos θi)^(1/3) in sr^(-1/3) over the same directions (Fores et al. 2012: predicts visual
    similarity)."""

    relative_l2: float
    log_relative_rms: float
    cube_root_rms: float
    limit: float


def compare(fit: TabulatedBRDF, truth: TabulatedBRDF, limit: float = 80.0) -> Differences:
    """Differences over the cells valid in both tables; limit in degrees.

    Raises PatinaError where the truth is zero in all of them.
    """
    centres = merl_grid.node_angles(0.5)
    both = fit.valid & truth.valid
    if not (truth.values[:, both] > 0).any():
        raise PatinaError(
            "nothing to compare: the true BRDF is zero in all cells that are valid in both"
        )
    angles = Angles(*(a[both] for a in centres))
    a, b = fit.values[:, both].astype(np.float64), truth.values[:, both].astype(np.float64)
    cos_i, cos_o = cosines(*angles)
    near = np.minimum(cos_i, cos_o) >= np.cos(np.radians(limit))
    return Differences(
        relative_l2=float(np.linalg.norm(a - b) / np.linalg.norm(b)),
        log_relative_rms=_rms(log_ratio(a[:, near], b[:, near], (cos_i * cos_o)[near])),
        cube_root_rms=_rms(np.cbrt(a[:, near] * cos_i[near]) - np.cbrt(b[:, near] * cos_i[near])),
        limit=limit,
    )


def log_ratio(
    fit: NDArray[np.floating], truth: NDArray[np.floating], cosine_product: NDArray[np.floating]
) -> NDArray[np.floating]:
    """ln((fit·cosMap + ε)/(truth·cosMap + ε)); the last axis runs over directions."""
    weight = np.clip(cosine_product, 0.01, 1.0)
    return np.log((fit * weight + EPSILON) / (truth * weight + EPSILON))


def _rms(x: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.mean(np.square(x))))
