"""What is compared, by name. An estimator is a function of samples, basis and seed."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from patina.core.angles import Angles
from patina.core.basis import Basis, PrincipalBRDF
from patina.core.fit import PaperSettings, fit_paper, ridge
from patina.core.fit.held_out import HeldOut
from patina.core.samples import SampleTable

CHUNK = 1 << 16
OUR_COMPONENTS = 120
_only: frozenset[str] | None = None
OURS = ("patina.core.fit.measured.estimate", "fit_measured")
"""Module and function of the program's own estimator; the rows are left out where it is missing."""


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


def ours() -> Callable[..., Any] | None:
    """The program's own estimator, or None while there is none."""
    try:
        return getattr(importlib.import_module(OURS[0]), OURS[1], None)
    except ImportError:
        return None


@dataclass(frozen=True)
class Ours:
    """What the program's own estimator returned."""

    result: Any

    def evaluate(self, angles: Angles) -> NDArray[np.floating]:
        """ρ (n, 3) in 1/sr."""
        return np.asarray(self.result.brdf.evaluate(angles))


def _ours(table: SampleTable, basis: Basis, seed: int) -> Ours:
    found = ours()
    if found is None:
        raise ImportError(f"{OURS[0]} is not here")
    return Ours(found(table, basis))


def interval(fit: Fitted) -> Interval | None:
    """The fit's 90 % bands, (low (n, 3), high (n, 3)) in 1/sr at angles, where it has any."""
    return getattr(getattr(fit, "result", None), "interval", None)


def reported(fit: Fitted) -> HeldOut | None:
    """What the program itself reports of held-out photos, where the fit says it."""
    held = getattr(getattr(fit, "result", None), "held_out", None)
    return held if isinstance(held, HeldOut) else None


def restrict(names: Sequence[str] | None) -> None:
    """Only these estimators are run from now on, in this process (None: all)."""
    global _only
    _only = None if names is None else frozenset(names)


def asked(name: str) -> bool:
    """True where an estimator is to be run."""
    return _only is None or name in _only


def rows() -> dict[str, Row]:
    """Name → what is compared; without the program's own where it is missing."""
    known = [
        Row("paper", paper),
        Row("all samples k=20", all_samples(20), random=False),
        Row("all samples k=40, true mesh", all_samples(40), true_mesh=True, random=False),
    ]
    if ours() is not None:
        known += [
            Row("ours", _ours, components=OUR_COMPONENTS, random=False),
            Row("ours, true mesh", _ours, True, components=OUR_COMPONENTS, random=False),
        ]
    return {row.name: row for row in known if asked(row.name)}
