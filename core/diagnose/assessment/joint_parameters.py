"""The parameters of all effects in the final joint fit: estimates, correlations, and impact.

The covariance is that of the joint fit, with the BRDFs and the patches of the surface free.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..nuisances.surface_variation import SurfaceVariation
from ..selection.one_step import ProjectedBaseline
from ..solver.model_fit import ModelFit
from .surface_correlation import surface_correlations

Vector = NDArray[np.float64]

CONFUSABLE = 0.8  # correlation of two effects beyond which the photos hardly distinguish them


@dataclass(frozen=True)
class JointParameters:
    """The fitted parameters (p,) of the effects that have few of them, those of the scan included.

    cause, name: of each. estimate: at the optimum. error: standard error. prior: standard deviation
    of the prior. correlation: (p, p) of the errors. impact: cause → RMS change of ln(ρ·cosMap + ε)
    in the pixels of the diagnosis, if the effect is off by one standard error. surface: cause →
    correlation with a reflectance that varies over the surface (surface_correlation.py).
    """

    cause: tuple[str, ...]
    name: tuple[str, ...]
    estimate: Vector
    error: Vector
    prior: Vector
    correlation: NDArray[np.float64]
    impact: dict[str, float]
    surface: dict[str, float]

    @property
    def pull(self) -> Vector:
        """(p,) estimates in units of the prior's standard deviation. Beyond 3, either the effect is
        real or the prior is too narrow."""
        return self.estimate / self.prior

    @property
    def ranked(self) -> list[tuple[str, float]]:
        """(cause, impact), largest impact first."""
        return sorted(self.impact.items(), key=lambda item: -item[1])

    @property
    def confusable(self) -> list[tuple[str, str, float]]:
        """(cause, other cause, largest correlation of their parameters), of effects that the photos
        hardly distinguish, largest first. A surface that varies is one of them."""
        found, causes = [], list(dict.fromkeys(self.cause))
        places = {c: np.flatnonzero(np.array(self.cause) == c) for c in causes}
        for k, one in enumerate(causes):
            for other in causes[k + 1 :]:
                most = float(np.abs(self.correlation[np.ix_(places[one], places[other])]).max())
                if most > CONFUSABLE:
                    found.append((one, other, most))
        varies = SurfaceVariation.cause
        found += [(c, varies, r) for c, r in self.surface.items() if r > CONFUSABLE]
        return sorted(found, key=lambda pair: -pair[2])

    @classmethod
    def of(cls, fit: ModelFit) -> JointParameters:
        """fit: at its optimum."""
        model = fit.model
        places = model.global_places
        declared = [model.effects[k].parameters for k in places]
        covariance = ProjectedBaseline.of(fit).dense
        size = model.brdfs.coefficients.size
        error = np.sqrt(np.maximum(np.diag(covariance)[size:], 0.0))
        scale = np.maximum(error, 1e-30)
        causes = tuple(model.effects[k].cause for k in places for _ in model.x[k])
        return cls(
            causes,
            tuple(name for one in declared for name in one.names),
            fit.identified,
            error,
            fit.joined(lambda parameters: parameters.deviation),
            covariance[size:, size:] / np.outer(scale, scale),
            _impact(fit, covariance, np.array(causes)),
            surface_correlations(fit),
        )


def _impact(
    fit: ModelFit, covariance: NDArray[np.floating], cause: NDArray[np.str_]
) -> dict[str, float]:
    """Cause → RMS over the pixels of the part of the error of ln(ρ·cosMap + ε) that the effect's
    errors cause: the trace of q · C_cx C_xx⁻¹ C_xc · qᵀ, where C is the covariance (M + p, M + p)
    of coefficients c and parameters x, and q the rows of the basis."""
    model = fit.model
    m, channels, k = model.brdfs.coefficients.shape
    rows = model.basis_rows(model.lamp_light.state).astype(np.float64)
    squares = [rows[model.pixels.material == index] for index in range(m)]
    grams, size = [q.T @ q for q in squares], m * channels * k
    found = {}
    for one in dict.fromkeys(cause.tolist()):
        mine = size + np.flatnonzero(cause == one)
        both = covariance[:size, mine]
        explained = both @ np.linalg.pinv(covariance[np.ix_(mine, mine)], hermitian=True) @ both.T
        blocks = explained.reshape(m, channels, k, m, channels, k)
        total = sum(
            float(np.sum(grams[index] * blocks[index, c, :, index, c, :]))
            for index in range(m)
            for c in range(channels)
        )
        found[one] = float(np.sqrt(max(total, 0.0) / (channels * max(len(rows), 1))))
    return found
