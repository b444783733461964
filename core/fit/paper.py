"""The paper's estimator: Ono et al. 2019, "Practical BRDF reconstruction using reliable geometric
regions from multi-view stereo", section 3. Every assumption can be switched off; without all three
it is Nielsen et al. 2015 on random subsets of the photos' pixels.

Where the equations are:
- (1)-(2) principal components: core/basis/training.py and components.py;
- (3) BRDF from coefficients: core/basis/principal_brdf.py;
- (4) reduced system of the observed rows: _one_trial here, from Basis.rows and Basis.mapped; it is
  solved by Nielsen's ridge regression (ridge.py);
- (5)-(7) curvature: core/geometry/curvature.py, its threshold in reliability.py;
- (8) monotonicity: reliability.monotone_with;
- (9) specular peak: reliability.highest_intensity.

Two choices that the paper leaves open:
- "Keep drawing until the chosen set is monotone": here only samples that are monotone with those
  already in the set may join it. Taken literally the loop hardly ever ends: of 150 sets chosen for
  their condition number alone, 0 to 11 are monotone on the captures that we measured.
- The similarity of prediction and photos is the cosine over the pixels of this material within the
  margins, as one vector of radiances.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..basis import Basis, PrincipalBRDF
from ..errors import FitError
from ..predict import similarity_sums
from ..samples import SampleTable, weighted
from . import reliability, ridge, selection

REDRAWS = 20  # subsets tried before a trial gives up on the monotonicity constraint


@dataclass(frozen=True)
class PaperSettings:
    """samples: n, number of samples, and of components (k = n). trials: number of random subsets.
    subset: candidates drawn for each. curvature: largest image-space mean curvature, 1/pixel; None
    for no test. monotonicity, highest_intensity: the paper's other two assumptions. eta: ridge
    parameter. seed: of the random subsets."""

    samples: int = 6
    trials: int = 10
    subset: int = 1000
    curvature: float | None = 0.2
    monotonicity: bool = True
    highest_intensity: bool = True
    eta: float = ridge.ETA
    seed: int = 0


@dataclass(frozen=True)
class PaperFit:
    """brdf: the candidate most similar to the photos. chosen: its samples (the specular peak first,
    where assumed). condition: the condition number of its system. candidates: (trials, 3, k)
    coefficients; similarity: (trials,) cosine similarity of each to the photos. reliable: number of
    samples that passed the curvature test. warnings: sentences for the report."""

    brdf: PrincipalBRDF
    chosen: SampleTable
    condition: float
    candidates: NDArray[np.float64]
    similarity: NDArray[np.float64]
    reliable: int
    warnings: tuple[str, ...] = field(default=())


def fit_paper(
    table: SampleTable,
    basis: Basis,
    settings: PaperSettings | None = None,
) -> PaperFit:
    """Fit one material. Raises FitError where too few samples are reliable."""
    s = settings or PaperSettings()
    warnings: list[str] = []
    reliable = np.flatnonzero(
        np.ones(len(table), bool)
        if s.curvature is None
        else reliability.below_curvature_limit(table.curvature, s.curvature)
    )
    if len(reliable) < 4 * s.samples:
        raise FitError(
            f"{len(table)} lit samples, {len(reliable)} of them below the curvature limit; "
            f"expected at least {4 * s.samples}; add photos or light, enlarge the masks, or raise "
            "the curvature limit"
        )
    peak = reliability.highest_intensity(table) if s.highest_intensity else None
    probability = table.weight[reliable].astype(np.float64)
    probability /= probability.sum()
    rng = np.random.default_rng(s.seed)
    trials = []
    for _ in range(s.trials):
        trials.append(_one_trial(table, reliable, probability, peak, basis, s, rng, warnings))
    candidates = np.stack([coefficients for coefficients, _, _ in trials])
    similarity = similarity_sums(basis, candidates, table)
    best = int(similarity.argmax())
    return PaperFit(
        brdf=PrincipalBRDF(basis, candidates[best]),
        chosen=trials[best][1],
        condition=trials[best][2],
        candidates=candidates,
        similarity=similarity,
        reliable=round(float(table.weight[reliable].sum(dtype=np.float64))),
        warnings=tuple(dict.fromkeys(warnings)),
    )


def _one_trial(
    table: SampleTable,
    reliable: NDArray[np.intp],
    probability: NDArray[np.float64],
    peak: tuple[int, SampleTable] | None,
    basis: Basis,
    s: PaperSettings,
    rng: np.random.Generator,
    warnings: list[str],
) -> tuple[NDArray[np.float64], SampleTable, float]:
    """Draw a subset, choose samples and solve the reduced system of their rows (equation (4)).

    Returns (coefficients (3, k), chosen samples, condition number).
    """
    for redraw in range(REDRAWS + 1):
        size = min(s.subset, len(reliable))
        if weighted.thinned(table):
            rows = rng.choice(reliable, size, replace=False, p=probability)
        else:
            rows = rng.choice(reliable, size, replace=False)
        drawn = table.select(rows if peak is None else rows[rows != peak[0]])
        if peak is not None:
            drawn = SampleTable.prepend(peak[1], drawn)
        q = basis.rows(drawn.angles, s.samples)[1]
        theta_h, brightness = drawn.theta_h, drawn.rho.mean(axis=1)
        last = redraw == REDRAWS
        free = not s.monotonicity or last

        def allowed(
            chosen: NDArray[np.intp],
            theta_h: NDArray[np.floating] = theta_h,
            brightness: NDArray[np.floating] = brightness,
            free: bool = free,
        ) -> NDArray[np.bool_]:
            if free:
                return np.ones(len(theta_h), bool)
            return reliability.monotone_with(theta_h, brightness, chosen)

        chosen = selection.choose(q, s.samples, allowed, fixed=None if peak is None else 0)
        if chosen is not None:
            if last and s.monotonicity:
                warnings.append(
                    "No monotone set of samples was found; the monotonicity test was skipped."
                )
            break
    else:  # pragma: no cover - the last draw is unconstrained
        raise FitError("no set of samples could be chosen")
    picked = drawn.select(chosen)
    q = q[chosen]
    mapped = basis.mapped(picked.rho, picked.angles)
    return ridge.solve(q, mapped, s.eta), picked, float(np.linalg.cond(q))
