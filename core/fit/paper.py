"""The paper's estimator: Ono et al. 2019, "Practical BRDF reconstruction using reliable geometric
regions from multi-view stereo", section 3. Every assumption can be switched off; with all three off
it is Nielsen et al. 2015 on random subsets of the photos' pixels.

Where the paper leaves room:
- "keep drawing until the chosen set is monotone" is met by letting only samples into the set that
  are monotone with those already in it. Taken literally it hardly ever ends: of 150 sets chosen for
  their condition number alone, 0 to 11 are monotone on the captures we measured.
- the similarity of prediction and photos is taken over the pixels the margins trust, of this
  material, as one vector of radiances.
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
    """samples: n, and components used (k = n). trials: random subsets tried. subset: candidates
    drawn for each. curvature: largest screen-space mean curvature, 1/pixel, None for no test.
    monotonicity, highest_intensity: the paper's other two assumptions. eta: ridge."""

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
    """brdf: the best candidate. chosen: its samples (the specular peak first, where assumed).
    condition: its condition number. candidates: (trials, 3, k); similarity: (trials,) cosine
    similarity of each to the photos. reliable: number of samples that passed the curvature test."""

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
        else reliability.calm(table.curvature, s.curvature)
    )
    if len(reliable) < 4 * s.samples:
        raise FitError(
            f"{len(table)} lit samples, {len(reliable)} of them on calm surface; "
            f"at least {4 * s.samples} are needed: more light, larger masks or a higher "
            "curvature threshold"
        )
    peak = reliability.highest_intensity(table) if s.highest_intensity else None
    likely = table.weight[reliable].astype(np.float64)
    likely /= likely.sum()
    rng = np.random.default_rng(s.seed)
    trials = []
    for _ in range(s.trials):
        trials.append(_one_trial(table, reliable, likely, peak, basis, s, rng, warnings))
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
    likely: NDArray[np.float64],
    peak: tuple[int, SampleTable] | None,
    basis: Basis,
    s: PaperSettings,
    rng: np.random.Generator,
    warnings: list[str],
) -> tuple[NDArray[np.float64], SampleTable, float]:
    """Draw a subset, choose samples, solve: (coefficients (3, k), chosen samples, condition)."""
    for redraw in range(REDRAWS + 1):
        size = min(s.subset, len(reliable))
        if weighted.thinned(table):
            rows = rng.choice(reliable, size, replace=False, p=likely)
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
                warnings.append("no monotone set of samples was found; the test was left out")
            break
    else:  # pragma: no cover - the last draw is unconstrained
        raise FitError("no set of samples could be chosen")
    picked = drawn.select(chosen)
    q = q[chosen]
    mapped = basis.mapped(picked.rho, picked.angles)
    return ridge.solve(q, mapped, s.eta), picked, float(np.linalg.cond(q))
