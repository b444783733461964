"""Samples → BRDF: every sample, all components, the scan's normals along."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...angles import Angles
from ...basis import Basis, PrincipalBRDF
from ...basis.log_table import LogTable
from ...concurrency.steps import drained
from ...errors import FitError
from ...samples import SampleTable
from .cells import gather
from .forward import CellModel
from .grazing_prior import carried_on
from .normals import TOLERANCE, refine_normals
from .patches import Patches
from .posterior import solve
from .power_likelihood import LEAST, tempered
from .prior import ChannelPrior
from .shrinkage import caution

FEWEST = 50  # samples
SETTLED = 0.02  # RMS change of ln ρ, all directions alike: the normals are refined enough
CHUNK = 1 << 15
WIDER = 1.5  # bands, than the posterior: no material is a draw from the measured ones' distribution
ALWAYS = 0.03  # of ln ρ: nothing is known better


@dataclass(frozen=True)
class MeasuredSettings:
    """components: how many of the basis, None for all. floor: log-relative deviation granted to
    the components themselves. normal_deviation: degrees per tangent that the scan's normals are
    off by, to begin with. rounds: of refining normals at most, 0 for none. coupled: the
    channels share what measured materials' channels share. trust: log-relative deviation of the
    anchors in unseen directions (infinite: no anchors)."""

    components: int | None = None
    floor: float = 0.15
    normal_deviation: float = 1.0
    rounds: int = 8
    coupled: bool = False
    trust: float = 1.5


@dataclass(frozen=True)
class MeasuredFit:
    """brdf: the most probable one, cautious where that is unsure (shrinkage.py). samples: how many.
    normal_deviation: degrees per tangent, what the scan's normals are off by. gains: photo → its
    own gain. anchoring: what unseen directions rest on, in words. without: photo → the BRDF had it
    not been there. covariance: (3, k, k) of each channel's coefficients. together: how many
    regions' votes count as one (cell_weights.py, power_likelihood.py)."""

    brdf: PrincipalBRDF
    samples: int
    normal_deviation: float
    gains: dict[int, float]
    anchoring: str
    without: dict[int, PrincipalBRDF]
    covariance: NDArray[np.float64]
    together: float
    warnings: tuple[str, ...] = ()

    def band(self, angles: Angles) -> NDArray[np.float64]:
        """(n, 3) standard deviation of ln(ρ·cosMap + ε) at n directions: the posterior's, widened
        to what `run.py experiments` finds it to be off by."""
        basis, k = self.brdf.basis, self.covariance.shape[1]
        n = len(angles.theta_h)
        out = np.empty((n, 3))
        root = np.linalg.cholesky(self.covariance + 1e-12 * np.eye(k))
        for start in range(0, n, CHUNK):
            part = slice(start, start + CHUNK)
            q = basis.rows(Angles(*(a[part] for a in angles)), k)[1].astype(np.float64)
            for c in range(3):
                out[part, c] = np.sqrt(WIDER**2 * np.sum((q @ root[c]) ** 2, axis=1) + ALWAYS**2)
        return out


def fit_measured(
    table: SampleTable, basis: Basis, settings: MeasuredSettings | None = None
) -> MeasuredFit:
    """Fit one material. Raises FitError where there are too few samples."""
    return drained(measured_steps(table, basis, settings))


def measured_steps(
    table: SampleTable, basis: Basis, settings: MeasuredSettings | None = None
) -> Generator[float, None, MeasuredFit]:
    """The same in steps: yields the fraction done."""
    s = settings or MeasuredSettings()
    table = _finite(table)
    if len(table) < FEWEST:
        raise FitError(
            f"{len(table)} lit samples, at least {FEWEST} are needed: more light or larger masks"
        )
    k = min(s.components or basis.count, basis.count)
    prior = ChannelPrior.of(basis, k, s.coupled)
    deviation = float(np.radians(s.normal_deviation))
    yield 0.0
    model = CellModel.of(gather(table, deviation), basis)
    found, together = tempered(model, prior, s.floor)
    patches = Patches.of_points(table.point) if s.rounds else None
    for done in range(s.rounds if patches is not None else 0):
        yield 0.1 + 0.6 * done / s.rounds
        brdf = LogTable.of(basis, found.coefficients)
        assert patches is not None
        # a BRDF unlike measured ones is itself in doubt: normals must not explain what it cannot
        tolerance = TOLERANCE * float(np.sqrt(together / LEAST))
        normals = refine_normals(table, patches, brdf, deviation, tolerance)
        deviation = normals.deviation
        yield 0.1 + 0.6 * (done + 0.5) / s.rounds
        model = CellModel.of(gather(normals.table, normals.error), basis)
        before = brdf.values
        together = max(LEAST, together / 2)
        found, together = tempered(model, prior, s.floor, found.coefficients, together)
        change = LogTable.of(basis, found.coefficients).values - before
        if np.sqrt(np.mean(change**2)) < SETTLED:
            break
    yield 0.7
    if np.isfinite(s.trust):
        prior = prior.anchored(carried_on(model, found.coefficients), s.trust)
    yield 0.95
    found = solve(model, prior, s.floor, found.coefficients, together=together)
    covariance = found.covariance()
    careful = caution(basis, covariance)
    return MeasuredFit(
        brdf=PrincipalBRDF(basis, found.coefficients + careful),
        samples=len(table),
        normal_deviation=float(np.degrees(deviation)),
        gains=found.gains,
        anchoring=_told(s.trust),
        without={p: PrincipalBRDF(basis, c + careful) for p, c in found.without.items()},
        covariance=covariance,
        together=together,
    )


def _finite(table: SampleTable) -> SampleTable:
    """Without rows that are not numbers: one of them would make every coefficient one of them."""
    light = table.irradiance
    good = (light > 0).all(axis=1) & np.isfinite(table.radiance).all(axis=1)
    with np.errstate(all="ignore"):
        good &= np.isfinite(table.radiance / light).all(axis=1)
    for values in (table.normal, table.view, table.light, table.point):
        good &= np.isfinite(values).all(axis=1)
    for values in (*table.angles, table.cos_i):
        good &= np.isfinite(values)
    return table if good.all() else table.select(good)


def _told(trust: float) -> str:
    if not np.isfinite(trust):
        return "directions that no photo saw follow measured materials"
    return (
        "directions that no photo saw follow measured materials and microfacet lobes, the lobes "
        f"trusted to a factor of {np.exp(trust):.1f}"
    )
