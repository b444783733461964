"""Derivatives of a prediction with respect to BRDF coefficients and effect parameters.

A parameter may affect only some pixels (those of a photo, of a patch of the surface). Parameters
that share no pixel share a slot: one difference quotient serves all of them, and a row of the
matrix holds one entry a slot, in the column of its pixel's parameter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ..effects.base.image_formation import changes_lamp_light
from .model import LampLight, Model
from .model_fit import ModelFit

Array = NDArray[np.floating]

LAMP_PARTS_FOR_ROWS = 3  # parts of a lamp whose basis rows stand for all: rows vary slowly
RELATIVE_STEP = 1e-3  # of the radiance, for the derivative of the camera response
DARKEST = 1e-20  # radiance, of any unit; the step of a darker pixel could be rounded to 0


@dataclass(frozen=True)
class Jacobian:
    """For n pixels, in units of their standard deviation.

    rho: (n, 3) ∂ prediction/∂ ln(ρ·cosMap + ε), the factor of the basis rows q, (n, k). x:
    (n, 3, s) ∂ prediction/∂ parameter, of the parameter in column (n, s) out of ``count``. local:
    (n, 3, e) ∂ prediction/∂ parameters of the pixel's patch; patch: (n,) −1 none; patches: their
    number.
    """

    rho: Array
    q: Array
    x: Array
    column: NDArray[np.int32]
    count: int
    local: Array
    patch: NDArray[np.intp]
    patches: int

    def matrix(self, rows: NDArray[np.intp], channel: int) -> csr_array:
        """(r, count) by the parameters, of some pixels."""
        slots = self.column.shape[1]
        starts = np.arange(len(rows) + 1) * slots
        values = self.x[rows, channel].ravel()
        return csr_array((values, self.column[rows].ravel(), starts), shape=(len(rows), self.count))

    def local_matrix(self, rows: NDArray[np.intp], channel: int) -> csr_array:
        """(r, patches · e) by the parameters of patches, of some pixels."""
        e = self.local.shape[2]
        column = np.maximum(self.patch[rows, None], 0) * e + np.arange(e)
        return csr_array(
            (self.local[rows, channel].ravel(), column.ravel(), np.arange(len(rows) + 1) * e),
            shape=(len(rows), self.patches * e),
        )


def jacobian_of(fit: ModelFit) -> Jacobian:
    """The Jacobian at the model's own parameters."""
    model, deviation = fit.model, fit.deviation
    light = model.lamp_light
    state, q = light.state, _basis_rows(model, light)
    entering = model.entering(light.reflected, state)
    recorded = model.recorded(entering, state)
    raised = (1 + RELATIVE_STEP) * entering
    bright = entering > DARKEST
    rise = np.where(bright, RELATIVE_STEP * entering, 1)
    camera = (model.recorded(raised, state) - recorded) / rise
    camera = np.where(bright, camera, 1.0)
    per_log = (light.log_derivative * camera / deviation).astype(np.float32)

    def by_slot(place: int) -> list[Array]:
        return _slot_derivatives(model, fit.deviation, place, recorded)

    n, first = len(model.pixels), 0
    x, column = [np.zeros((n, 3, 0), np.float32)], [np.zeros((n, 0), np.int32)]
    for place in model.global_places:
        x += [derivative[..., None] for derivative in by_slot(place)]
        column.append(first + np.maximum(model.parameter_index(place), 0).astype(np.int32))
        first += len(model.effects[place].parameters)
    local, patch, patches = np.zeros((n, 3, 0), np.float32), np.full(n, -1), 0
    if model.patch_place is not None and model.patch_effect is not None:
        local = np.stack(by_slot(model.patch_place), axis=2)
        patch, patches = model.patch_effect.patch, model.patch_effect.count
    joined, columns = np.concatenate(x, axis=2), np.concatenate(column, axis=1)
    return Jacobian(per_log, q, joined, columns, first, local, patch, patches)


def effect_derivatives(model: Model, deviation: Array, place: int) -> Array:
    """(n, 3, p) derivatives of the prediction with respect to all parameters of one effect, in
    units of the deviation."""
    index = model.parameter_index(place)
    out = np.zeros((len(deviation), 3, len(model.effects[place].parameters)), np.float32)
    found = _slot_derivatives(model, deviation, place, model.predicted())
    for slot, derivative in zip(index.T, found, strict=True):
        rows = np.flatnonzero(slot >= 0)
        out[rows, :, slot[rows]] = derivative[rows]
    return out


def _slot_derivatives(model: Model, deviation: Array, place: int, recorded: Array) -> list[Array]:
    """For each slot of an effect: (n, 3) derivatives with respect to the pixel's parameter, 0 where
    it has none. recorded: (n, 3) the prediction."""
    effect, found = model.effects[place], list[Array]()
    combined, without_lamp = effect.combined_slots, effect.slots_without_lamp_light
    for number, slot in enumerate(model.parameter_index(place).T):
        if number in combined:
            parts = (factor[:, None] * found[k] for k, factor in combined[number].items())
            found.append(np.sum(list(parts), axis=0, dtype=np.float32))
            continue
        mine = np.unique(slot[slot >= 0])
        step = effect.parameters.step[mine[0]] if len(mine) else 1.0
        of_lamp = changes_lamp_light(effect) and number not in without_lamp
        stepped = _stepped(model, place, mine, step, of_lamp)
        derivative = (stepped - recorded) / (step * deviation)
        found.append(np.where(slot[:, None] >= 0, derivative, 0).astype(np.float32))
    return found


def _basis_rows(model: Model, light: LampLight) -> Array:
    """Q̂ (n, k): means over a few parts of the lamp, weighted by their contributions."""
    parts, brdfs = model.lamp_parts(light.state), model.brdfs
    if len(parts) == 1:
        return model.basis_rows(light.state)
    q = total = np.zeros((), np.float32)
    for part in parts[:: max(1, len(parts) // LAMP_PARTS_FOR_ROWS)]:
        share = brdfs.log_derivative(part).mean(axis=1, dtype=np.float32)[:, None]
        share = share + np.float32(1e-12)
        total, q = total + share, q + share * model.basis_rows(part)
    return np.asarray(q / total)


def _stepped(
    model: Model, place: int, parameters: NDArray[np.intp], step: float, of_lamp: bool
) -> Array:
    """(n, 3) the prediction with some parameters of one effect increased by a step. of_lamp:
    whether they change the reflected light of the lamp."""
    x = list(model.x)
    x[place] = x[place].copy()
    x[place][parameters] += step
    if of_lamp:
        return model.predicted(x)
    return model.photographed(model.lamp_light.state, model.lamp_light.reflected, x)
