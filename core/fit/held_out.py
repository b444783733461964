"""Held-out photos: fit without one photo and predict it."""

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

DARK = 0.05  # of the median radiance: below it noise dominates relative errors


@dataclass(frozen=True)
class HeldOutPhoto:
    """The errors of one photo predicted from the others. squared_error, size: sums of squares of L̂
    − L and of L, in the photo's own encoding; relative: (m,) mean |L̂ − L| over the channels,
    divided by the mean L, of the pixels that are not dark; weight: (m,) how many pixels each of
    them represents."""

    photo: int
    squared_error: float
    size: float
    relative: NDArray[np.floating]
    weight: NDArray[np.float32]


Judge = Callable[[int, PrincipalBRDF], HeldOutPhoto]
"""(photo, BRDF fitted without it) → errors of the prediction."""


@dataclass(frozen=True)
class HeldOutErrors:
    """Errors of photos predicted from the other photos. per_photo: photo index → relative RMS error
    ‖L̂ − L‖ / ‖L‖ of its lit pixels, all channels, in the photo's own encoding. error: the same
    over all photos together. typical: median over all pixels of the channels' mean |L̂ − L| divided
    by the mean L."""

    error: float
    typical: float
    per_photo: dict[int, float]


def photos_to_hold_out(table: SampleTable) -> list[int]:
    """The photos that show the material; none where there are fewer than two."""
    photos = np.unique(table.photo).tolist()
    return photos if len(photos) > 1 else []


def fit_without_photo(
    table: SampleTable,
    photo: int,
    basis: Basis,
    settings: PaperSettings,
    judge: Judge | None = None,
) -> HeldOutPhoto | None:
    """Fit with the paper's method without a photo and predict it; None where the other photos have
    too few samples for a fit. judge: predicts the photo; None: ``prediction_errors``."""
    rest = table.select(table.photo != photo)
    try:
        fit = fit_paper(rest, basis, replace(settings, seed=settings.seed + 1))
    except FitError:
        return None
    return prediction_errors(table, photo, fit.brdf) if judge is None else judge(photo, fit.brdf)


def prediction_errors(table: SampleTable, photo: int, brdf: PrincipalBRDF) -> HeldOutPhoto:
    """Errors of a photo predicted by a BRDF that was fitted without it, with the scan's normals."""
    held = table.select((table.photo == photo) & table.read)
    return errors_of_radiance(photo, predict_radiance(brdf, held), held)


def errors_of_radiance(photo: int, shown: NDArray[np.floating], held: SampleTable) -> HeldOutPhoto:
    """Errors of the predicted radiance (n, 3) of a photo's samples."""
    difference = shown - held.radiance
    level = held.radiance.mean(axis=1)
    bright = level > max(DARK * weighted.median(level, held.weight), 0.0)
    weight = held.weight[:, None]
    return HeldOutPhoto(
        photo=photo,
        squared_error=float(
            np.sum(weight * np.square(held.response * difference, dtype=np.float64))
        ),
        size=float(np.sum(weight * np.square(held.response * held.radiance, dtype=np.float64))),
        relative=np.abs(difference).mean(axis=1)[bright] / level[bright],
        weight=held.weight[bright],
    )


def summarise(parts: Sequence[HeldOutPhoto]) -> HeldOutErrors | None:
    """Errors of all held-out photos together; None where there are none, or all are black."""
    parts = [p for p in parts if p.size > 0]  # a black photo has no relative error
    if not parts:
        return None
    relative = np.concatenate([p.relative for p in parts])
    weight = np.concatenate([p.weight for p in parts])
    error = _ratio(sum(p.squared_error for p in parts), sum(p.size for p in parts))
    return HeldOutErrors(
        error=error,
        typical=weighted.median(relative, weight) if relative.size else error,
        per_photo={p.photo: _ratio(p.squared_error, p.size) for p in parts},
    )


def _ratio(squared_error: float, size: float) -> float:
    """Relative RMS error from two sums of squares."""
    return float(np.sqrt(squared_error / size))
