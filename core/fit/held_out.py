"""How well a fit predicts a photo it has not seen: leave one photo out, refit, predict it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..basis import Basis
from ..errors import FitError
from ..predict import predict_radiance
from ..samples import SampleTable
from .paper import PaperSettings, fit_paper


@dataclass(frozen=True)
class HeldOut:
    """per_photo: photo index → relative RMS error ‖L̂ − L‖ / ‖L‖ of its lit pixels, all channels,
    predicted from the other photos. error: the same over all of them together. typical: median
    over all pixels of |L̂ − L| / L, channel means: what most of the surface is off by."""

    error: float
    typical: float
    per_photo: dict[int, float]


def held_out_error(
    table: SampleTable,
    basis: Basis,
    settings: PaperSettings,
    progress: Callable[[float], None] = lambda fraction: None,
) -> HeldOut | None:
    """None where fewer than two photos see the material."""
    photos = np.unique(table.photo)
    if len(photos) < 2:
        return None
    per_photo: dict[int, float] = {}
    wrong = total = 0.0
    relative = []
    for done, photo in enumerate(photos):
        progress(done / len(photos))
        out = table.photo == photo
        try:
            fit = fit_paper(table.select(~out), basis, replace(settings, seed=settings.seed + 1))
        except FitError:
            continue  # this photo carries nearly all samples: the rest cannot speak for it
        held = table.select(out)
        difference = predict_radiance(basis, fit.brdf.coefficients, held) - held.radiance
        level = held.radiance.mean(axis=1)
        bright = level > 0.05 * np.median(level)  # relative errors of the noise say nothing
        relative.append(np.abs(difference.mean(axis=1))[bright] / level[bright])
        missed = float(np.sum(np.square(difference, dtype=np.float64)))
        size = float(np.sum(np.square(held.radiance, dtype=np.float64)))
        per_photo[int(photo)] = float(np.sqrt(missed / max(size, 1e-300)))
        wrong, total = wrong + missed, total + size
    if not per_photo:
        return None
    return HeldOut(
        error=float(np.sqrt(wrong / max(total, 1e-300))),
        typical=float(np.median(np.concatenate(relative))),
        per_photo=per_photo,
    )
