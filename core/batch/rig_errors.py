"""Causes that the objects of one session have in common: an error of the rig, not of an object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .summary import Summary

MIN_OBJECTS = 3  # with the cause: two may agree by chance
MIN_SHARE = 0.5  # of the session's objects that have the cause
MIN_Z = 3.0  # standard errors by which a common value differs from zero


@dataclass(frozen=True)
class CommonValue:
    """A parameter over the objects. value, error: mean and its standard error; spread: standard
    deviation between the objects, beyond their own errors."""

    name: str
    unit: str
    value: float
    error: float
    spread: float


@dataclass(frozen=True)
class RigError:
    """A cause that a session has in common. objects: in how many of ``of`` it was named; values:
    parameters that are the same in all, within their errors and ``spread``."""

    session: str
    label: str
    objects: int
    of: int
    values: tuple[CommonValue, ...]

    @property
    def sentence(self) -> str:
        """For users."""
        where = f"Session {self.session}: " if self.session else ""
        values = "; ".join(
            f"{one.name} {one.value:.3g} ± {one.error:.1g} {one.unit}".strip()
            + f" (varies by {one.spread:.1g} between objects)"
            for one in self.values
        )
        return (
            f"{where}{self.label} in {self.objects} of {self.of} objects: {values}. This is an "
            "error of the rig: correct it there, or in the capture files of the whole session."
        )


def rig_errors(summaries: Sequence[Summary]) -> list[RigError]:
    """The causes that at least half of a session's diagnosed objects have, with a common value.

    Means over the objects are those of DerSimonian and Laird (1986), which allow for differences
    between objects.
    """
    found = []
    sessions = sorted({one.item.session for one in summaries})
    for session in sessions:
        own = [s for s in summaries if s.item.session == session and s.causes is not None]
        names = sorted({c.name for s in own for c in s.causes or () if c.named})
        for name in names:
            having = [c for s in own for c in s.causes or () if c.name == name and c.named]
            if len(having) < max(MIN_OBJECTS, MIN_SHARE * len(own)):
                continue
            values = []
            for key in sorted({key for c in having for key in c.parameters}):
                rows = [c.parameters[key] for c in having if key in c.parameters]
                if len(rows) < max(MIN_OBJECTS, MIN_SHARE * len(having)):
                    continue  # of an object, such as that of one of its photos
                numbers, errors = np.array([(value, error) for value, error, _ in rows]).T
                mean, error, spread = common_mean(numbers, errors)
                if abs(mean) > MIN_Z * error and spread < abs(mean):
                    values.append(CommonValue(key, rows[0][2], mean, error, spread))
            if values:
                found.append(
                    RigError(session, having[0].label, len(having), len(own), tuple(values))
                )
    return found


def common_mean(
    values: NDArray[np.float64], errors: NDArray[np.float64]
) -> tuple[float, float, float]:
    """(mean, its standard error, standard deviation between the values beyond ``errors``) of
    measurements (n,) with standard errors (n,), by DerSimonian and Laird (1986)."""
    errors = np.maximum(errors, 1e-12 + 1e-6 * np.abs(values).max())
    weights = errors**-2.0
    mean = np.average(values, weights=weights)
    excess = np.sum(weights * (values - mean) ** 2) - (len(values) - 1)
    scale = weights.sum() - np.sum(weights**2) / weights.sum()
    between = max(0.0, float(excess / scale)) if scale > 0 else 0.0
    weights = 1.0 / (errors**2 + between)
    return float(np.average(values, weights=weights)), float(weights.sum() ** -0.5), between**0.5
