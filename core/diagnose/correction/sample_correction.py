"""Samples corrected for the effects that a diagnosis named: the input of the second fit.

The camera's effects are inverted by one Newton step about the prediction, which noise cannot throw
far off. Added light is subtracted. Directions, irradiance and visibility are as the effects make
them. Highlights that a large lamp or a brushed surface widens stay wide in the samples
(highlight_deconvolution.py narrows them). A clipped channel cannot be corrected: it is imputed from
the joint fit (clipping_imputation.py) and is no evidence when held-out photos are judged.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...angles import half_difference
from ...angles.vectors import dot
from ...samples import SampleTable
from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.pixels import Pixels
from ..forward.shading_state import ShadingState
from ..solver.model import Model
from .clipping_imputation import impute_clipped, plateau_of
from .highlight_deconvolution import BlurredPhoto, HighlightBlur, blurred_photo, widens_highlights
from .sample_pixels import nearest

Array = NDArray[np.floating]

CHUNK = 20_000  # samples at a time: what each sees around itself takes a kilobyte
SIGHTS = 20  # directions: what is off in one sample is not in the next
NUDGE = 1e-2  # of the prediction
LEAST_RESPONSE = 0.2  # ∂ ln recorded/∂ ln light: less is a plateau, or the veil of another place
STEPS = 4  # of Newton, where the prediction is beyond a plateau
AT_PLATEAU = 0.03  # so near, relative, is at it
LEAST_COS, LEAST_LIGHT = 0.05, 0.5  # θi; part of the lamp's light that arrives


@dataclass(frozen=True)
class CorrectedSamples:
    """table: samples (m,) that can be corrected; light: for each photo the RMS of what it tells of
    the lamp's light on those, as it shows it, over that of all that it shows of them; blur: of
    their highlights, None where there is none."""

    table: SampleTable
    light: Mapping[int, float]
    blur: HighlightBlur | None


def correct_samples(
    table: SampleTable, pixels: Pixels, model: Model, context: DiagnosisContext, tilt: float = 0.0
) -> Generator[float, None, CorrectedSamples]:
    """Of samples (n,), photo by photo; yields the fraction done.
    pixels: of the samples (sample_pixels.py); model: with the effects, at its optimum; context: of
    the diagnosis; tilt: radians along each tangent that the scan's normals are off by."""
    parts, wide = [], list[BlurredPhoto]()
    blur = widens_highlights(model)
    near = nearest(pixels, context.pixels, context.size)
    done = 0
    for rows in _chunks(pixels, near, context):
        yield done / len(pixels)
        done += len(rows)
        here = replace(context, pixels=pixels.select(rows), brdfs=model.brdfs, ray_count=SIGHTS)
        moved = model_at_pixels(model, here, near.select(rows))
        *part, good = _corrected(table.select(rows), moved, tilt)
        parts.append(part)
        if blur:
            wide.append(blurred_photo(int(table.photo[rows[0]]), moved, good))
    if not parts:
        return CorrectedSamples(SampleTable.empty(), {}, None)
    tables, left, whole = zip(*parts, strict=True)
    found = SampleTable.concatenate(tables)
    of_lamp, of_all = (np.bincount(found.photo, np.concatenate(each)) for each in (left, whole))
    ratio = np.sqrt(of_lamp / np.maximum(of_all, 1e-30))
    light = {int(photo): float(ratio[photo]) for photo in np.unique(found.photo)}
    return CorrectedSamples(found, light, HighlightBlur(tuple(wide)) if blur else None)


def _chunks(
    pixels: Pixels, near: NearestPixels, context: DiagnosisContext
) -> Iterator[NDArray[np.intp]]:
    """Of one photo each. Of a photo that the diagnosis did not look at nothing is known."""
    known = context.pixels.photo[near.photo] == pixels.photo
    for photo in np.unique(pixels.photo[known]):
        rows = np.flatnonzero(known & (pixels.photo == photo))
        for start in range(0, len(rows), CHUNK):
            yield rows[start : start + CHUNK]


def model_at_pixels(model: Model, context: DiagnosisContext, near: NearestPixels) -> Model:
    """The same model for the context's pixels; near: of the model's own the nearest."""
    effects, x = [], []
    for effect, numbers in zip(model.effects, model.x, strict=True):
        moved = effect.at_pixels(context, near)
        if moved is not None:
            effects.append(moved)
            x.append(effect.identified(numbers))
    return Model(context.pixels, model.brdfs, tuple(effects), tuple(x))


def _corrected(
    table: SampleTable, model: Model, tilt: float
) -> tuple[SampleTable, Array, Array, NDArray[np.intp]]:
    """(samples, squares of their radiance as the photos show it, 0 of what they do not tell, and of
    all that they show, the rows that they are of)."""
    now = model.shading()
    lamps = model.lamp_parts(now)
    reflected = model.reflected(lamps)
    predicted = model.entering(reflected, now)
    added = predicted - reflected
    plateau = plateau_of(model, now, np.maximum(predicted, table.radiance))
    clipped = table.radiance > (1 - AT_PLATEAU) * plateau
    # where only the prediction is beyond the plateau, the photo says how much light arrived
    below = ~clipped & (predicted > (1 - AT_PLATEAU) * plateau)
    entering = np.where(below, np.minimum(table.radiance, predicted), predicted)
    recorded, response = _response(model, now, entering)
    for _ in range(STEPS if below.any() else 0):
        nearer = entering + (table.radiance - recorded) / np.maximum(response, LEAST_RESPONSE)
        entering = np.where(below, np.clip(nearer, entering / 2, predicted), entering)
        recorded, response = _response(model, now, entering)
    relative = response * entering / np.where(recorded > 0, recorded, np.inf)
    good = ((relative > LEAST_RESPONSE) | clipped).all(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):  # of what is not good
        arrived = entering + (table.radiance - recorded) / response
    at = np.where(clipped, plateau, np.inf)
    drawn = impute_clipped(model, now, added, at, arrived, tilt)
    if widens_highlights(model):  # what is drawn is of a point, not stretched
        point = model.brdfs.reflected(replace(now, stretch=None))
        drawn *= reflected / np.maximum(point, 1e-30)
    radiance = np.where(clipped, drawn, arrived - added)
    response = np.where(clipped, 0, response)
    lamp = response * radiance
    cos_i = dot(now.normal, now.light)
    cos_o = dot(now.normal, table.view)
    good &= (cos_i > LEAST_COS) & (cos_o > LEAST_COS) & (now.visible > LEAST_LIGHT)
    good &= np.isfinite(radiance).all(axis=1)
    irradiance = (now.irradiance * now.visible[:, None]).astype(np.float32)
    angles = half_difference(now.normal, now.light, table.view)
    rho = radiance / np.maximum(irradiance * np.maximum(cos_i, LEAST_COS)[:, None], 1e-30)
    rows = np.flatnonzero(good)
    found = replace(
        table,
        theta_h=np.asarray(angles.theta_h, np.float32),
        theta_d=np.asarray(angles.theta_d, np.float32),
        phi_d=np.asarray(angles.phi_d, np.float32),
        cos_i=cos_i.astype(np.float32),
        cos_o=cos_o.astype(np.float32),
        rho=rho.astype(np.float32),
        radiance=radiance.astype(np.float32),
        irradiance=irradiance,
        normal=np.asarray(now.normal, np.float32),
        light=np.asarray(now.light, np.float32),
        response=(table.response * response).astype(np.float32),
    ).select(rows)
    # what is clipped is shown as it is predicted: no miss, but a part of what the photo shows
    left, whole = (found.weight * np.sum(e[rows] ** 2, axis=1) for e in (lamp, table.radiance))
    return found, left * found.read, whole, rows


def _response(model: Model, now: ShadingState, entering: Array) -> tuple[Array, Array]:
    """(n, 3) what photos show of this light, and how much more of a little more."""
    recorded = model.recorded(entering, now)
    step = NUDGE * np.maximum(entering, 1e-12)
    return recorded, (model.recorded(entering + step, now) - recorded) / step
