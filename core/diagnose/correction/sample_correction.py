"""Samples corrected for the effects that a diagnosis named: the input of the second fit.

The camera's effects are inverted by one Newton step about the prediction, which noise cannot throw
far off. Added light is subtracted. Directions, irradiance and visibility are as the effects make
them. Highlights that a large lamp or a brushed surface widens stay wide in the samples
(highlight_deconvolution.py narrows them). A clipped channel cannot be corrected: it is imputed from
the model's BRDFs (clipping_imputation.py) and is no evidence when held-out photos are judged.
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
from ..solver.scaled_brdfs import with_scaled_brdfs
from .clipping_imputation import impute_clipped, plateau_of
from .highlight_deconvolution import BlurredPhoto, HighlightBlur, blurred_photo, widens_highlights
from .sample_pixels import nearest

Array = NDArray[np.floating]

CHUNK = 20_000  # samples at a time: the surroundings of each take a kilobyte
RAY_COUNT = 20  # rays per sample; their errors are independent between samples
STEP = 1e-2  # of the prediction, for difference quotients
MIN_RESPONSE = 0.2  # ∂ ln recorded/∂ ln light; below it is a plateau, or the veil of another place
NEWTON_STEPS = 4  # where the prediction is beyond a plateau
AT_PLATEAU = 0.03  # relative distance from a plateau that counts as clipped
MIN_COS, MIN_LIGHT = 0.05, 0.5  # cosines of θi and θo; fraction of the lamp's light that arrives


@dataclass(frozen=True)
class CorrectedSamples:
    """table: the samples (m,) that can be corrected; rows: (m,) their indices in the given table.
    light: photo → RMS of the recorded radiance of the lamp on these samples, divided by the RMS of
    their whole recorded radiance. blur: of their highlights, None where there is none."""

    table: SampleTable
    rows: NDArray[np.intp]
    light: Mapping[int, float]
    blur: HighlightBlur | None


def correct_samples(
    table: SampleTable,
    pixels: Pixels,
    model: Model,
    context: DiagnosisContext,
    tilt: float = 0.0,
    shown: Model | None = None,
    impute: bool = True,
) -> Generator[float, None, CorrectedSamples]:
    """Correct samples (n,), photo by photo; yields the fraction done. Where a sample's response
    is 0, its radiance is a lower limit, and so is the corrected one.

    pixels: of the samples (sample_pixels.py). model: with the effects, at its optimum. context: of
    the diagnosis. tilt: radians along each tangent, standard deviation of the scan's normals.
    shown: the model whose normals and light the corrected samples get, and whose added light is
    subtracted (None: ``model``): without the variation of the surface where that is to be estimated
    from them. impute: whether clipped channels get a likely radiance; otherwise a lower limit."""
    parts, wide = [], list[BlurredPhoto]()
    model = with_scaled_brdfs(model)  # once: the BRDFs keep tables of their values
    blur = widens_highlights(model)
    near = nearest(pixels, context.pixels, context.size)
    done = 0
    for rows in _chunks(pixels, near, context):
        yield done / len(pixels)
        done += len(rows)
        here = replace(context, pixels=pixels.select(rows), brdfs=model.brdfs, ray_count=RAY_COUNT)
        local = model_at_pixels(model, here, near.select(rows))
        own = None if shown is None else model_at_pixels(shown, here, near.select(rows))
        *part, good = _correct_chunk(table.select(rows), local, tilt, own, impute)
        parts.append((*part, rows[good]))
        if blur:
            wide.append(blurred_photo(int(table.photo[rows[0]]), local, good))
    if not parts:
        return CorrectedSamples(SampleTable.empty(), np.zeros(0, np.intp), {}, None)
    tables, left, whole, kept = zip(*parts, strict=True)
    found = SampleTable.concatenate(tables)
    of_lamp, of_all = (np.bincount(found.photo, np.concatenate(each)) for each in (left, whole))
    ratio = np.sqrt(of_lamp / np.maximum(of_all, 1e-30))
    of_photo = {int(photo): float(ratio[photo]) for photo in np.unique(found.photo)}
    blurred = HighlightBlur(tuple(wide)) if blur else None
    return CorrectedSamples(found, np.concatenate(kept), of_photo, blurred)


def _chunks(
    pixels: Pixels, near: NearestPixels, context: DiagnosisContext
) -> Iterator[NDArray[np.intp]]:
    """Indices of samples of one photo at a time. Photos that are not in the diagnosis are
    skipped."""
    known = context.pixels.photo[near.photo] == pixels.photo
    for photo in np.unique(pixels.photo[known]):
        rows = np.flatnonzero(known & (pixels.photo == photo))
        for start in range(0, len(rows), CHUNK):
            yield rows[start : start + CHUNK]


def model_at_pixels(model: Model, context: DiagnosisContext, near: NearestPixels) -> Model:
    """The same model for the pixels of ``context``; near: the nearest pixels of the model."""
    effects, x = [], []
    for effect, values in zip(model.effects, model.x, strict=True):
        local = effect.at_pixels(context, near)
        if local is not None:
            effects.append(local)
            x.append(effect.identified(values))
    return Model(context.pixels, model.brdfs, tuple(effects), tuple(x))


def _correct_chunk(
    table: SampleTable, model: Model, tilt: float, shown: Model | None, impute: bool
) -> tuple[SampleTable, Array, Array, NDArray[np.intp]]:
    """(samples, weighted squares of the recorded radiance of the lamp, 0 where it is clipped, the
    same of the whole recorded radiance, indices of the samples in ``table``). shown: the model of
    the corrected samples; None: ``model``."""
    now = model.shading()
    lamps = model.lamp_parts(now)
    reflected = model.reflected(lamps)
    predicted = model.entering(reflected, now)
    added = (model if shown is None else shown).entering(reflected, now) - reflected
    plateau = plateau_of(model, now, np.maximum(predicted, table.radiance))
    limit = table.response == 0
    clipped = (table.radiance > (1 - AT_PLATEAU) * plateau) & ~limit
    # where only the prediction is beyond the plateau, the photo determines how much light arrived,
    # and where the radiance is a lower limit, it determines how much arrived at least
    beyond = (predicted > (1 - AT_PLATEAU) * plateau) | (limit & (predicted > table.radiance))
    below = ~clipped & beyond
    entering = np.where(below, np.minimum(table.radiance, predicted), predicted)
    recorded, response = _response(model, now, entering)
    for _ in range(NEWTON_STEPS if below.any() else 0):
        nearer = entering + (table.radiance - recorded) / np.maximum(response, MIN_RESPONSE)
        entering = np.where(below, np.clip(nearer, entering / 2, predicted), entering)
        recorded, response = _response(model, now, entering)
    relative = response * entering / np.where(recorded > 0, recorded, np.inf)
    good = ((relative > MIN_RESPONSE) | clipped).all(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):  # not used where ``good`` is false
        arrived = entering + (table.radiance - recorded) / response
    at = np.where(clipped, plateau, np.inf)
    if not impute:
        beyond_plateau = np.maximum(at - added, 0)
    else:
        beyond_plateau = impute_clipped(model, now, added, at, arrived, tilt)
        if widens_highlights(model):  # the imputed radiance is of a point lamp and isotropic
            point = model.brdfs.reflected(replace(now, stretch=None))
            beyond_plateau *= reflected / np.maximum(point, 1e-30)
    radiance = np.where(clipped, beyond_plateau, arrived - added)
    # radiance is the recorded value divided by the response; an imputed value keeps its variance
    divisor = np.where(clipped | (response <= 0), 1.0, response)
    response = np.where(clipped, 0, response)
    with np.errstate(invalid="ignore"):  # nor here
        lamp = response * radiance
    now = now if shown is None else shown.shading()
    cos_i = dot(now.normal, now.light)
    cos_o = dot(now.normal, table.view)
    good &= (cos_i > MIN_COS) & (cos_o > MIN_COS) & (now.visible > MIN_LIGHT)
    good &= np.isfinite(radiance).all(axis=1)
    irradiance = (now.irradiance * now.visible[:, None]).astype(np.float32)
    angles = half_difference(now.normal, now.light, table.view)
    rho = radiance / np.maximum(irradiance * np.maximum(cos_i, MIN_COS)[:, None], 1e-30)
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
        variance=(table.variance / divisor**2).astype(np.float32),
        irradiance=irradiance,
        normal=np.asarray(now.normal, np.float32),
        light=np.asarray(now.light, np.float32),
        response=(table.response * response).astype(np.float32),
    ).select(rows)
    # clipped channels have no residual, but are part of the whole radiance
    left, whole = (found.weight * np.sum(e[rows] ** 2, axis=1) for e in (lamp, table.radiance))
    return found, left * found.read, whole, rows


def _response(model: Model, now: ShadingState, entering: Array) -> tuple[Array, Array]:
    """(n, 3) recorded radiance of this light, and (n, 3) its derivative."""
    recorded = model.recorded(entering, now)
    step = STEP * np.maximum(entering, 1e-12)
    return recorded, (model.recorded(entering + step, now) - recorded) / step
