"""The estimators that are compared, by name: functions of samples, basis and seed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from patina.core.angles import Angles
from patina.core.basis import Basis, PrincipalBRDF
from patina.core.fit import PaperSettings, fit_paper, ridge
from patina.core.fit.held_out import HeldOutErrors, photos_to_hold_out, prediction_errors, summarise
from patina.core.fit.measured import fit_measured
from patina.core.fit.measured_result import MeasuredResult
from patina.core.samples import SampleTable

CHUNK = 1 << 16
OUR_COMPONENTS = 100
MERL_PRIOR = "ours, prior of MERL"
_only: frozenset[str] | None = None


class Fitted(Protocol):
    """A fitted BRDF."""

    def evaluate(self, angles: Angles) -> NDArray[np.floating]:
        """Return ρ (n, 3) in 1/sr."""


Interval = Callable[[Angles], tuple[NDArray[np.floating], NDArray[np.floating]]]
Estimator = Callable[[SampleTable, Basis, int], Fitted]


@dataclass(frozen=True)
class Row:
    """One row of a table. true_mesh: the estimator gets the exact surface (an oracle); components:
    size of its basis; random: whether it is random itself, apart from the noise of the photos;
    merl_prior: the prior is learnt from MERL alone."""

    name: str
    estimator: Estimator
    true_mesh: bool = False
    components: int = 40
    random: bool = True
    merl_prior: bool = False


def paper(table: SampleTable, basis: Basis, seed: int) -> PrincipalBRDF:
    """The method of Ono et al. 2019 with all its assumptions."""
    return fit_paper(table, basis, PaperSettings(seed=seed)).brdf


def paper_with(**changes: Any) -> Estimator:
    """Return the paper's method with changed settings."""

    def estimate(table: SampleTable, basis: Basis, seed: int) -> PrincipalBRDF:
        return fit_paper(table, basis, replace(PaperSettings(), seed=seed, **changes)).brdf

    return estimate


def all_samples(count: int, eta: float = ridge.ETA) -> Estimator:
    """Return ridge regression over all samples, in the mapped space (Nielsen et al. 2015)."""

    def estimate(table: SampleTable, basis: Basis, seed: int) -> PrincipalBRDF:
        gram, right = np.zeros((count, count)), np.zeros((count, 3))
        for start in range(0, len(table), CHUNK):
            part = slice(start, start + CHUNK)
            angles = Angles(*(a[part] for a in table.angles))
            q = basis.rows(angles, count)[1].astype(np.float64)
            gram += q.T @ q
            right += q.T @ basis.mapped(table.rho[part], angles)
        c = np.linalg.solve(gram + eta * np.eye(count), right).T
        return PrincipalBRDF(basis, c)

    return estimate


@dataclass(frozen=True)
class Ours:
    """Result of Patina's estimator. held_out: the error on held-out photos that Patina reports."""

    result: MeasuredResult
    held_out: HeldOutErrors | None

    def evaluate(self, angles: Angles) -> NDArray[np.floating]:
        """ρ (n, 3) in 1/sr."""
        return np.asarray(self.result.brdf.evaluate(angles))


def ours(table: SampleTable, basis: Basis, seed: int) -> Ours:
    """Patina's estimator, as the program runs it."""
    fit = fit_measured(table, basis)
    held_out_photos = [p for p in photos_to_hold_out(table) if p in fit.without]
    summary = summarise([prediction_errors(table, p, fit.without[p]) for p in held_out_photos])
    return Ours(MeasuredResult.of(fit), summary)


def interval(fit: Fitted) -> Interval | None:
    """Return the function angles → 90 % interval (low (n, 3), high (n, 3)) in 1/sr, or None."""
    return fit.result.interval if isinstance(fit, Ours) else None


def reported(fit: Fitted) -> HeldOutErrors | None:
    """Return the error on held-out photos that Patina reports; None for other estimators."""
    return fit.held_out if isinstance(fit, Ours) else None


def select(names: Sequence[str] | None) -> None:
    """Select the estimators that this process runs (None: all)."""
    global _only
    _only = None if names is None else frozenset(names)


def is_selected(name: str) -> bool:
    """Return whether an estimator is selected."""
    return _only is None or name in _only


def rows() -> dict[str, Row]:
    """Return name → row of the selected estimators."""
    known = [
        Row("paper", paper),
        Row("all samples k=20", all_samples(20), random=False),
        Row("all samples k=40, true mesh", all_samples(40), true_mesh=True, random=False),
        Row("ours", ours, components=OUR_COMPONENTS, random=False),
        Row("ours, true mesh", ours, True, components=OUR_COMPONENTS, random=False),
        Row(MERL_PRIOR, ours, components=OUR_COMPONENTS, random=False, merl_prior=True),
    ]
    return {row.name: row for row in known if is_selected(row.name)}
