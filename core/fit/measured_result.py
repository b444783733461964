"""What is kept of a measured fit once its samples are let go: megabytes, not hundreds of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..basis import AngleGrid, PrincipalBRDF, mapping
from .measured import MeasuredFit
from .spread import Spread, directions

COARSE = (42, 24, 10)  # nodes of the band: it is smooth, the BRDF is not
NINETY = 1.6449  # standard deviations to either side that hold 90 % of a normal distribution


@dataclass(frozen=True)
class Band:
    """How far ln(ρ·cosMap + ε) may be off. values: (grid.size, 3) standard deviations."""

    grid: AngleGrid
    values: NDArray[np.float32]

    @staticmethod
    def from_values(values: NDArray[np.floating], knee: float) -> Band:
        """values: (n, 3) of a band; knee: of its BRDF's basis. Raises ValueError."""
        grid = AngleGrid(*COARSE, knee)
        return Band(grid, np.asarray(values, np.float32).reshape(grid.size, 3))

    @staticmethod
    def of(fit: MeasuredFit) -> Band:
        """The fit's own, at the nodes of a coarser grid."""
        grid = AngleGrid(*COARSE, fit.brdf.basis.grid.knee)
        nodes = Angles(*(a.ravel() for a in grid.nodes()))
        return Band(grid, fit.band(nodes).astype(np.float32))

    def deviation(self, angles: Angles) -> NDArray[np.float32]:
        """(n, 3) at n directions."""
        return self.grid.interpolate(self.values, angles)

    def factor(self, angles: Angles) -> NDArray[np.float32]:
        """(n, 3) what ρ·cosMap + ε may be larger or smaller by, in nine of ten cases at most."""
        return np.exp(np.float32(NINETY) * self.deviation(angles))

    def interval(
        self, brdf: PrincipalBRDF, angles: Angles
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(low, high) (n, 3) in 1/sr: the 90 % interval of the BRDF that the band is of, at n
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
        """In three numbers."""
        angles = directions(self.grid)
        return Spread.of(self.deviation(angles), angles)


@dataclass(frozen=True)
class MeasuredResult:
    """brdf: the most probable one, all components. normal_deviation: degrees along each tangent
    that the scan's normals are off by. gains: photo → what it is brighter by than the BRDF that
    all of them give: its exposure, and what no BRDF of the basis explains.
    anchoring: what the BRDF rests on where no photo looked. samples: how many were used."""

    brdf: PrincipalBRDF
    samples: int
    normal_deviation: float
    gains: dict[int, float]
    anchoring: str
    band: Band
    warnings: tuple[str, ...]

    @staticmethod
    def of(fit: MeasuredFit) -> MeasuredResult:
        """Without samples, model and posterior."""
        return MeasuredResult(
            brdf=fit.brdf,
            samples=fit.samples,
            normal_deviation=fit.normal_deviation,
            gains=dict(fit.gains),
            anchoring=fit.anchoring,
            band=Band.of(fit),
            warnings=fit.warnings,
        )

    def interval(self, angles: Angles) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(low, high) (n, 3) in 1/sr: the 90 % interval at n directions."""
        return self.band.interval(self.brdf, angles)

    def odd_gains(self, least: float) -> dict[int, float]:
        """The gains that differ from 1 by more than ``least``, photo → gain."""
        return {photo: g for photo, g in self.gains.items() if abs(g - 1) > least}
