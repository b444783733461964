"""What is kept of a measured fit without its samples: some megabytes instead of hundreds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..basis import AngleGrid, PrincipalBRDF, mapping
from .measured import MeasuredFit
from .spread import Spread, directions

COARSE = (42, 24, 10)  # nodes of the band, over θh, θd and φd: it is smoother than the BRDF
NINETY_PERCENT = 1.6449  # 90 % of a normal distribution lie within so many standard deviations


@dataclass(frozen=True)
class Band:
    """Standard deviation of ln(ρ·cosMap + ε). values: (grid.size, 3)."""

    grid: AngleGrid
    values: NDArray[np.float32]

    @staticmethod
    def from_values(values: NDArray[np.floating], knee: float) -> Band:
        """values: (n, 3) of a band; knee: that of the grid of its BRDF's basis. Raises
        ValueError."""
        grid = AngleGrid(*COARSE, knee)
        return Band(grid, np.asarray(values, np.float32).reshape(grid.size, 3))

    @staticmethod
    def of(fit: MeasuredFit) -> Band:
        """The band of a fit, at the nodes of a coarser grid."""
        grid = AngleGrid(*COARSE, fit.brdf.basis.grid.knee)
        nodes = Angles(*(a.ravel() for a in grid.nodes()))
        return Band(grid, fit.band(nodes).astype(np.float32))

    def deviation(self, angles: Angles) -> NDArray[np.float32]:
        """(n, 3) standard deviation at n directions."""
        return self.grid.interpolate(self.values, angles)

    def factor(self, angles: Angles) -> NDArray[np.float32]:
        """(n, 3) factor by which ρ·cosMap + ε may be larger or smaller: half the width of the 90 %
        interval, in the logarithm."""
        return np.exp(np.float32(NINETY_PERCENT) * self.deviation(angles))

    def interval(
        self, brdf: PrincipalBRDF, angles: Angles
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(low, high) (n, 3) in 1/sr: the 90 % interval of the BRDF of this band at n
        directions."""
        weight = mapping.cos_map(angles).astype(np.float32)[:, None]
        level = brdf.evaluate(angles) * weight + np.float32(mapping.EPSILON)
        factor = self.factor(angles)
        low, high = level / factor, level * factor
        return (
            np.maximum(low - np.float32(mapping.EPSILON), 0) / weight,
            np.maximum(high - np.float32(mapping.EPSILON), 0) / weight,
        )

    def spread(self) -> Spread:
        """The three summary values of the band."""
        angles = directions(self.grid)
        return Spread.of(self.deviation(angles), angles)


@dataclass(frozen=True)
class MeasuredResult:
    """brdf: the most probable one, all components. normal_deviation: degrees along each tangent,
    standard deviation of the scan's normals. gains: photo → factor by which it is brighter than the
    BRDF of all photos predicts: its exposure, and what no BRDF of the basis explains.
    extrapolation: what the BRDF rests on in directions without samples. samples: how many were
    used. covariance: (k, k) posterior covariance of the coefficients, mean of the channels.
    cells_per_region: (REGIONS,) cells of samples in each region of angle space."""

    brdf: PrincipalBRDF
    samples: int
    normal_deviation: float
    gains: dict[int, float]
    extrapolation: str
    band: Band
    warnings: tuple[str, ...]
    covariance: NDArray[np.float64]
    cells_per_region: NDArray[np.intp]

    @staticmethod
    def of(fit: MeasuredFit) -> MeasuredResult:
        """The fit without its samples and model."""
        return MeasuredResult(
            brdf=fit.brdf,
            samples=fit.samples,
            normal_deviation=fit.normal_deviation,
            gains=dict(fit.gains),
            extrapolation=fit.extrapolation,
            band=Band.of(fit),
            warnings=fit.warnings,
            covariance=fit.covariance.mean(axis=0),
            cells_per_region=fit.cells_per_region,
        )

    def interval(self, angles: Angles) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(low, high) (n, 3) in 1/sr: the 90 % interval at n directions."""
        return self.band.interval(self.brdf, angles)

    def gains_beyond(self, limit: float) -> dict[int, float]:
        """The gains that differ from 1 by more than ``limit``: photo → gain."""
        return {photo: g for photo, g in self.gains.items() if abs(g - 1) > limit}
