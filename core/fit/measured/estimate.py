"""The measured estimator: samples → BRDF from every sample and all components, refining the scan's
normals along the way."""

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
from ...noise.basis_error import BASIS_ERROR
from ...samples import SampleTable
from .cell_weights import REGIONS, region_of
from .cells import gather
from .forward import CellModel
from .grazing_prior import extrapolated
from .normals import TOLERANCE, refine_normals
from .patches import Patches
from .posterior import solve
from .prior import CoefficientPrior
from .prior_scale import solve_again, solve_with_scale
from .shrinkage import shrinkage_step

MIN_SAMPLES = 50
CONVERGED = 0.02  # RMS change of ln(ρ·cosMap + ε) over the grid below which refinement ends
FIRST_SOLVE, USUAL_ROUNDS = 0.25, 4  # for progress: time before the rounds, number of rounds
CHUNK = 1 << 15  # directions
MAX_TOLERANCE_SCALE = 4.0  # scale of the prior up to which it makes normals more cautious
# factor on the posterior's standard deviation: no material is a draw from the training distribution
BAND_FACTOR = 2.0
MIN_BAND = 0.03  # standard deviation of ln ρ that is always added


@dataclass(frozen=True)
class MeasuredSettings:
    """components: how many of the basis, None for all. floor: relative standard deviation of the
    basis' error far from black (core/noise/basis_error.py). normal_deviation: degrees along each
    tangent, initial standard deviation of the scan's normals. rounds: largest number of normal
    refinements, 0 for none. trust: log-relative standard deviation of the grazing prior
    (grazing_prior.py) in directions without samples; infinite switches it off."""

    components: int | None = None
    floor: float = BASIS_ERROR
    normal_deviation: float = 1.0
    rounds: int = 8
    trust: float = 1.5


@dataclass(frozen=True)
class MeasuredFit:
    """brdf: the posterior mode, lowered where it is uncertain (shrinkage.py). samples: how many
    were used. normal_deviation: degrees along each tangent, estimated standard deviation of the
    scan's normals. gains: photo → its gain. extrapolation: a sentence that says what the BRDF rests
    on in directions without samples. without: photo → the BRDF without that photo. covariance: (3,
    k, k) posterior covariance of each channel's coefficients. prior_scale: how far the material is
    from the measured ones (prior_scale.py). cells_per_region: (REGIONS,) number of cells without
    clipped samples in each region of angle space (cell_weights.py)."""

    brdf: PrincipalBRDF
    samples: int
    normal_deviation: float
    gains: dict[int, float]
    extrapolation: str
    without: dict[int, PrincipalBRDF]
    covariance: NDArray[np.float64]
    prior_scale: float
    cells_per_region: NDArray[np.intp]
    warnings: tuple[str, ...] = ()

    def band(self, angles: Angles) -> NDArray[np.float64]:
        """(n, 3) standard deviation of ln(ρ·cosMap + ε) at n directions: that of the posterior,
        widened by BAND_FACTOR and MIN_BAND to the errors that `run.py experiments` measures."""
        basis, k = self.brdf.basis, self.covariance.shape[1]
        n = len(angles.theta_h)
        out = np.empty((n, 3))
        root = np.linalg.cholesky(self.covariance + 1e-12 * np.eye(k))
        for start in range(0, n, CHUNK):
            part = slice(start, start + CHUNK)
            q = basis.rows(Angles(*(a[part] for a in angles)), k)[1].astype(np.float64)
            for c in range(3):
                out[part, c] = np.sqrt(
                    BAND_FACTOR**2 * np.sum((q @ root[c]) ** 2, axis=1) + MIN_BAND**2
                )
        return out


def fit_measured(
    table: SampleTable,
    basis: Basis,
    settings: MeasuredSettings | None = None,
    clipped: SampleTable | None = None,
) -> MeasuredFit:
    """Fit one material. Raises FitError where there are too few samples.

    clipped: samples with a clipped channel, in addition: where their response is 0, the radiance
    is a lower limit.
    """
    return drained(measured_steps(table, basis, settings, clipped))


def measured_steps(
    table: SampleTable,
    basis: Basis,
    settings: MeasuredSettings | None = None,
    clipped: SampleTable | None = None,
) -> Generator[float, None, MeasuredFit]:
    """fit_measured as a generator: yields the fraction done and returns the fit."""
    s = settings or MeasuredSettings()
    table = _finite(table)
    if len(table) < MIN_SAMPLES:
        raise FitError(
            f"{len(table)} lit samples; expected at least {MIN_SAMPLES}; "
            "add photos or light, or enlarge the masks"
        )
    samples = len(table)
    k = min(s.components or basis.count, basis.count)
    prior = CoefficientPrior.of(basis, k)
    deviation = float(np.radians(s.normal_deviation))
    yield 0.0
    table, limited = _with_clipped(table, clipped)
    model = CellModel.of(gather(table, deviation, clipped=limited), basis)
    found, scale = solve_with_scale(model, prior, s.floor)
    patches = Patches.of_points(table.point) if s.rounds else None
    for done in range(s.rounds if patches is not None else 0):
        yield _fraction(done)
        brdf = LogTable.of(basis, found.coefficients)
        assert patches is not None
        # a BRDF unlike the measured materials is uncertain: normals must not absorb its errors
        tolerance = TOLERANCE * float(np.sqrt(min(scale, MAX_TOLERANCE_SCALE)))
        some = None if limited is None else limited.any(axis=1)
        normals = refine_normals(table, patches, brdf, deviation, tolerance, some)
        deviation = normals.deviation
        yield _fraction(done + 0.5)
        model = CellModel.of(gather(normals.table, normals.error, clipped=limited), basis)
        before = brdf.values
        found, scale = solve_again(model, prior, s.floor, found, scale)
        change = LogTable.of(basis, found.coefficients).values - before
        if np.sqrt(np.mean(change**2)) < CONVERGED:
            break
    yield 0.95
    prior = prior.scaled(scale)
    if np.isfinite(s.trust):
        prior = prior.with_grazing_prior(extrapolated(model, found.coefficients), s.trust)
    yield 0.97
    found = solve(model, prior, s.floor, found.coefficients)
    covariance = found.covariance()
    shrinkage = shrinkage_step(basis, covariance)
    unlimited = found.covariance_of_measured()
    return MeasuredFit(
        brdf=PrincipalBRDF(basis, found.coefficients + shrinkage),
        samples=samples,
        normal_deviation=float(np.degrees(deviation)),
        gains=found.gains,
        extrapolation=_anchoring_text(s.trust),
        without={p: PrincipalBRDF(basis, c + shrinkage) for p, c in found.without.items()},
        covariance=covariance if unlimited is None else unlimited,
        prior_scale=scale,
        cells_per_region=np.bincount(
            region_of(model.cells.angles), ~model.cells.clipped.any(axis=1), REGIONS
        ).astype(np.intp),
    )


def _with_clipped(
    table: SampleTable, clipped: SampleTable | None
) -> tuple[SampleTable, NDArray[np.bool_] | None]:
    """(the samples and the clipped ones, (n, 3) whether the radiance is a lower limit or None)."""
    clipped = None if clipped is None else _finite(clipped)
    if clipped is None or not len(clipped):
        return table, None
    none = np.zeros((len(table), 3), bool)
    limited = np.concatenate([none, clipped.response == 0])
    return SampleTable.concatenate([table, clipped]), limited


def _finite(table: SampleTable) -> SampleTable:
    """The table without rows that are not finite: one of them would make every coefficient NaN."""
    light = table.irradiance
    good = (light > 0).all(axis=1) & np.isfinite(table.radiance).all(axis=1)
    with np.errstate(all="ignore"):
        good &= np.isfinite(table.radiance / light).all(axis=1)
    for values in (table.normal, table.view, table.light, table.point):
        good &= np.isfinite(values).all(axis=1)
    for values in (*table.angles, table.cos_i):
        good &= np.isfinite(values)
    return table if good.all() else table.select(good)


def _anchoring_text(trust: float) -> str:
    """A sentence for the report: what the BRDF rests on where no photo has samples."""
    if not np.isfinite(trust):
        return "Directions without samples follow the measured materials."
    return (
        "Directions without samples follow the measured materials and microfacet lobes (the lobes "
        f"within a factor of {np.exp(trust):.1f})."
    )


def _fraction(rounds: float) -> float:
    """Fraction of a fit that is done after a number of rounds of normals. How many follow is not
    known before they converge; they are mostly three to five."""
    usual = USUAL_ROUNDS - 1
    done = rounds / USUAL_ROUNDS if rounds < usual else 1 - 0.5 ** (rounds - usual) / USUAL_ROUNDS
    return FIRST_SOLVE + (0.95 - FIRST_SOLVE) * done
