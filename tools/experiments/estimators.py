"""What is compared, by name. An estimator is a function of samples, basis and seed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from patina.core.angles import Angles
from patina.core.basis import Basis, PrincipalBRDF
from patina.core.fit import PaperSettings, fit_paper, ridge
from patina.core.fit.held_out import HeldOut, photos_to_hold_out, predicted, summarise
from patina.core.fit.measured import fit_measured
from patina.core.fit.measured_result import MeasuredResult
from patina.core.samples import SampleTable

CHUNK = 1 << 16
OUR_COMPONENTS = 100
_only: frozenset[str] | None = None


class Fitted(Protocol):
    """A BRDF that was fitted."""

    def evaluate(self, angles: Angles) -> NDArray[np.floating]:
        """ρ (n, 3) in 1/sr."""


Interval = Callable[[Angles], tuple[NDArray[np.floating], NDArray[np.floating]]]
Estimator = Callable[[SampleTable, Basis, int], Fitted]


@dataclass(frozen=True)
class Row:
    """One line of a table. true_mesh: it is given the exact surface (an oracle); components: what
    its basis needs; random: whether the result depends on the seed but for the noise."""

    name: str
    estimator: Estimator
    true_mesh: bool = False
    components: int = 40
    random: bool = True


def paper(table: SampleTable, basis: Basis, seed: int) -> PrincipalBRDF:
    """Ono et al. 2019, everything on."""
    return fit_paper(table, basis, PaperSettings(seed=seed)).brdf


def paper_with(**changes: Any) -> Estimator:
    """The paper's method with some of its settings changed."""

    def estimate(table: SampleTable, basis: Basis, seed: int) -> PrincipalBRDF:
        return fit_paper(table, basis, replace(PaperSettings(), seed=seed, **changes)).brdf

    return estimate


def all_samples(count: int, eta: float = ridge.ETA) -> Estimator:
    """Plain ridge over every sample, in the mapped space."""

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
    """What the program's own estimator returned. held_out: what the program reports of it."""

    result: MeasuredResult
    held_out: HeldOut | None

    def evaluate(self, angles: Angles) -> NDArray[np.floating]:
        """ρ (n, 3) in 1/sr."""
        return np.asarray(self.result.brdf.evaluate(angles))


def ours(table: SampleTable, basis: Basis, seed: int) -> Ours:
    """Patina's own, as the program runs it."""
    fit = fit_measured(table, basis)
    unseen = [p for p in photos_to_hold_out(table) if p in fit.without]
    held = summarise([predicted(table, p, fit.without[p]) for p in unseen])
    return Ours(MeasuredResult.of(fit), held)


def interval(fit: Fitted) -> Interval | None:
    """The fit's 90 % bands, (low (n, 3), high (n, 3)) in 1/sr at angles, where it has any."""
    return fit.result.interval if isinstance(fit, Ours) else None


def reported(fit: Fitted) -> HeldOut | None:
    """What the program itself reports of held-out photos, where the fit says it."""
    return fit.held_out if isinstance(fit, Ours) else None


def restrict(names: Sequence[str] | None) -> None:
    """Only these estimators are run from now on, in this process (None: all)."""
    global _only
    _only = None if names is None else frozenset(names)


def asked(name: str) -> bool:
    """True where an estimator is to be run."""
    return _only is None or name in _only


def rows() -> dict[str, Row]:
    """Name → what is compared."""
    known = [
        Row("paper", paper),
        Row("all samples k=20", all_samples(20), random=False),
        Row("all samples k=40, true mesh", all_samples(40), true_mesh=True, random=False),
        Row("ours", ours, components=OUR_COMPONENTS, random=False),
        Row("ours, true mesh", ours, True, components=OUR_COMPONENTS, random=False),
    ]
    return {row.name: row for row in known if asked(row.name)}
