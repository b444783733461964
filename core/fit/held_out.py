"""How well a fit predicts a photo it has not seen: leave one photo out, fit, predict it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..basis import Basis, PrincipalBRDF
from ..errors import FitError
from ..predict import predict_radiance
from ..samples import SampleTable, weighted
from .paper import PaperSettings, fit_paper

Judge = Callable[[int, PrincipalBRDF], "LeftOut"]
"""(photo, BRDF that was found without it) → how well it is predicted."""

DARK = 0.05  # of the median radiance: below it relative errors are those of the noise


@dataclass(frozen=True)
class LeftOut:
    """One photo predicted from the others. missed, size: sums of squares of L̂ − L and of L, as
    the photo shows them; relative: (m,) channels' mean |L̂ − L| over mean L, of its pixels that are
    not dark; weight: (m,) how many pixels each of them stands for."""

    photo: int
    missed: float
    size: float
    relative: NDArray[np.floating]
    weight: NDArray[np.float32]


@dataclass(frozen=True)
class HeldOut:
    """per_photo: photo index → relative RMS error ‖L̂ − L‖ / ‖L‖ of its lit pixels, all channels,
    as the photo shows them, predicted from the other photos. error: the same over all of them
    together. typical: median over all pixels of the channels' mean |L̂ − L| over mean L: what most
    of it is off by."""

    error: float
    typical: float
    per_photo: dict[int, float]


def photos_to_hold_out(table: SampleTable) -> list[int]:
    """The photos that see the material; none where there are fewer than two."""
    photos = np.unique(table.photo).tolist()
    return photos if len(photos) > 1 else []


def leave_out(
    table: SampleTable,
    photo: int,
    basis: Basis,
    settings: PaperSettings,
    judge: Judge | None = None,
) -> LeftOut | None:
    """The paper's fit without a photo, predicting it; None where the rest is too little to fit.
    judge: how it is predicted, None: ``predicted``."""
    rest = table.select(table.photo != photo)
    try:
        fit = fit_paper(rest, basis, replace(settings, seed=settings.seed + 1))
    except FitError:
        return None
    return predicted(table, photo, fit.brdf) if judge is None else judge(photo, fit.brdf)


def predicted(table: SampleTable, photo: int, brdf: PrincipalBRDF) -> LeftOut:
    """How well a BRDF that was found without a photo predicts it, at the scan's own normals."""
    held = table.select((table.photo == photo) & table.read)
    return compared(photo, predict_radiance(brdf, held), held)


def compared(photo: int, shown: NDArray[np.floating], held: SampleTable) -> LeftOut:
    """A photo's samples beside the radiance (n, 3) that is predicted of them."""
    difference = shown - held.radiance
    level = held.radiance.mean(axis=1)
    bright = level > max(DARK * weighted.median(level, held.weight), 0.0)
    weight = held.weight[:, None]
    return LeftOut(
        photo=photo,
        missed=float(np.sum(weight * np.square(held.response * difference, dtype=np.float64))),
        size=float(np.sum(weight * np.square(held.response * held.radiance, dtype=np.float64))),
        relative=np.abs(difference).mean(axis=1)[bright] / level[bright],
        weight=held.weight[bright],
    )


def summarise(parts: Sequence[LeftOut]) -> HeldOut | None:
    """All held-out photos together; None where there are none, or none with any light."""
    parts = [p for p in parts if p.size > 0]  # of a black photo no error is a fraction
    if not parts:
        return None
    relative = np.concatenate([p.relative for p in parts])
    weight = np.concatenate([p.weight for p in parts])
    error = _ratio(sum(p.missed for p in parts), sum(p.size for p in parts))
    return HeldOut(
        error=error,
        typical=weighted.median(relative, weight) if relative.size else error,
        per_photo={p.photo: _ratio(p.missed, p.size) for p in parts},
    )


def _ratio(missed: float, size: float) -> float:
    return float(np.sqrt(missed / size))
