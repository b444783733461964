"""The materials of a capture as sums of the dictionary's BRDFs, fitted to one or several lamps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .shading import Array, LampPixels, non_negative, predicted

ROUNDS = 4  # of alternating gains and coefficients


def own_materials(pixels: LampPixels, radiance: Array, count: int) -> NDArray[np.float64]:
    """(count, k) coefficients of the materials from one lamp alone, in units of its irradiance."""
    found = np.zeros((count, radiance.shape[1]))
    w = pixels.measured.weight
    for index in range(count):
        own = pixels.material == index if count > 1 else slice(None)
        if count == 1 or own.any():  # type: ignore[union-attr]
            target = (pixels.measured.radiance * w)[own]
            found[index] = non_negative(radiance[own] * w[own, None], target)
    return found


def shared_materials(
    lamps: Sequence[LampPixels], radiance: Sequence[Array], start: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(m, k) coefficients of the materials that explain all lamps, each with a gain of its own.

    radiance: for each lamp (n, k), of the dictionary. start: (m, k). Absolute residuals are
    minimised by reweighted least squares. The scale of the result is arbitrary.
    """
    found = start
    for _ in range(ROUNDS):
        matrices, targets, materials = [], [], []
        for pixels, values in zip(lamps, radiance, strict=True):
            before = predicted(values, found, pixels.material)
            gain = pixels.measured.gain(before)
            w = pixels.measured.weight * np.sqrt(
                pixels.measured.robust_weight(gain * before) / max(len(before), 1)
            )
            matrices.append(values * (gain * w)[:, None])
            targets.append(pixels.measured.radiance * w)
            materials.append(pixels.material)
        matrix, target = np.concatenate(matrices), np.concatenate(targets)
        material = np.concatenate(materials)
        found = np.stack([
            non_negative(matrix[material == m], target[material == m])
            if (material == m).any() else found[m]
            for m in range(len(found))
        ])  # fmt: skip
        total = float(found.sum())
        if not total > 0:
            return start
        found = found / total
    return found
