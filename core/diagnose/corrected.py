"""Samples as they would be without the effects that a diagnosis named: what an estimator is given.

What the camera did is taken back by one Newton step about the prediction, which no noise can throw
far; light that was added is subtracted; directions, irradiance and shadows are what the effects
make them; and what a lamp's size or a stretched highlight does is a ratio of two predictions. Of
a channel that is clipped nothing can be taken back: it stands as the joint fit draws it
(beyond_plateau.py), and counts as no evidence of what unseen photos show.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..angles.vectors import dot
from ..samples import SampleTable
from .beyond_plateau import beyond_plateau, plateau_of
from .effect import Near, Setting
from .model import Model
from .of_samples import nearest
from .pixels import Pixels
from .situation import Situation

Array = NDArray[np.floating]

CHUNK = 20_000  # samples at a time: what each sees around itself takes a kilobyte
SIGHTS = 20  # directions: what is off in one sample is not in the next
NUDGE = 1e-2  # of the prediction
LEAST_RESPONSE = 0.2  # ∂ ln recorded/∂ ln light: less is a plateau, or the veil of another place
STEPS = 4  # of Newton, where the prediction is beyond a plateau
AT_PLATEAU = 0.03  # so near, relative, is at it
LEAST_COS, LEAST_LIGHT = 0.05, 0.5  # θi; part of the lamp's light that arrives
FARTHEST = 3.0  # factor by which a prediction may correct


def corrected(
    table: SampleTable, pixels: Pixels, model: Model, setting: Setting, tilt: float = 0.0
) -> Generator[float, None, tuple[SampleTable, dict[int, float]]]:
    """Samples (n,) → (those, m ≤ n, that can be corrected, for each photo the RMS of what it tells
    of the lamp's light on those, as it shows it, over that of all that it shows of them); yields
    the fraction done.
    pixels: of the samples (of_samples.py); model: with the effects, at its optimum; setting: that
    it was made for; tilt: radians along each tangent that the scan's normals are off by."""
    parts = []
    near = nearest(pixels, setting.pixels, setting.size)
    # of a photo that the diagnosis did not look at nothing is known
    known = np.flatnonzero(setting.pixels.photo[near.photo] == pixels.photo)
    for start in range(0, len(known), CHUNK):
        yield start / len(known)
        rows = known[start : start + CHUNK]
        here = replace(setting, pixels=pixels.select(rows), brdfs=model.brdfs, sights=SIGHTS)
        moved = elsewhere(model, here, near.select(rows))
        parts.append(_corrected(table.select(rows), moved, tilt))
    if not parts:
        return SampleTable.empty(), {}
    tables, left, whole = zip(*parts, strict=True)
    found = SampleTable.concatenate(tables)
    of_lamp, of_all = (np.bincount(found.photo, np.concatenate(each)) for each in (left, whole))
    ratio = np.sqrt(of_lamp / np.maximum(of_all, 1e-30))
    return found, {int(photo): float(ratio[photo]) for photo in np.unique(found.photo)}


def elsewhere(model: Model, setting: Setting, near: Near) -> Model:
    """The same model for the setting's pixels; near: of the model's own the nearest."""
    effects, x = [], []
    for effect, numbers in zip(model.effects, model.x, strict=True):
        moved = effect.elsewhere(setting, near)
        if moved is not None:
            effects.append(moved)
            x.append(effect.told(numbers))
    return Model(setting.pixels, model.brdfs, tuple(effects), tuple(x))


def _corrected(
    table: SampleTable, model: Model, tilt: float
) -> tuple[SampleTable, Array, Array]:
    """(samples, squares of their radiance as the photos show it, 0 of what they do not tell, and of
    all that they show)."""
    now = model.situation()
    lamps = model.lamps(now)
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
    drawn = beyond_plateau(model, now, added, at, arrived, tilt)
    radiance = np.where(clipped, drawn, arrived - added)
    response = np.where(clipped, 0, response)
    lamp = response * radiance
    if len(lamps) > 1 or now.stretch is not None:  # what is drawn is of a point, not stretched
        point = model.brdfs.reflected(replace(now, stretch=None))
        ratio = np.where(clipped, 1, point / np.maximum(reflected, 1e-30))
        good &= ((ratio < FARTHEST) & (ratio > 1 / FARTHEST)).all(axis=1)
        radiance, response = radiance * ratio, response / ratio
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
    return found, left * found.read, whole


def _response(model: Model, now: Situation, entering: Array) -> tuple[Array, Array]:
    """(n, 3) what photos show of this light, and how much more of a little more."""
    recorded = model.recorded(entering, now)
    step = NUDGE * np.maximum(entering, 1e-12)
    return recorded, (model.recorded(entering + step, now) - recorded) / step
