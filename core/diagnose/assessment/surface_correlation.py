"""How far a surface that varies could imitate an effect.

An effect that is the same in all photos that show a place (a veil, a lens that darkens the corners
in photos from one view, light from the room) looks there like another reflectance. The correlation
of the change by an effect with its own mean over each patch is that with a reflectance that varies
from patch to patch: 1, and only photos from other views or under other lights would tell; 0, and
the variation of the surface has absorbed nothing of it.
"""

from __future__ import annotations

import numpy as np

from ..effects.base.surface_patches import mean_of
from ..nuisances.material_scale import MaterialScale
from ..nuisances.pose_jitter import PoseJitter
from ..nuisances.surface_variation import SurfaceVariation
from ..solver.model_fit import ModelFit

BRIGHT = 0.05  # of the 90th percentile of the prediction; darker pixels do not count


def surface_correlations(fit: ModelFit) -> dict[str, float]:
    """Cause → correlation with a reflectance that varies from patch to patch, of the causes in a
    joint fit that have few parameters; empty where the surface is too small for patches."""
    model = fit.model
    patch = next((e.patch for e in model.effects if isinstance(e, SurfaceVariation)), None)
    level = fit.predicted.mean(axis=1)
    if patch is None:
        return {}
    counted = (patch >= 0) & (level > BRIGHT * np.percentile(level, 90))
    counted &= np.isfinite(fit.deviation).all(axis=1)
    rows = np.flatnonzero(counted)
    _, own = np.unique(patch[rows], return_inverse=True)
    material, found = model.pixels.material[rows], dict[str, float]()
    for effect in (model.effects[place] for place in model.global_places):
        if isinstance(effect, MaterialScale | PoseJitter):
            continue
        cause = effect.cause
        change = level[rows] - model.predicted_without(cause).mean(axis=1)[rows]
        change = change / level[rows]
        for index in np.unique(material):  # of the whole material: the BRDF has absorbed it
            change[material == index] -= change[material == index].mean()
        common = mean_of(own, change[:, None])[own, 0]
        total = float(np.sum(change**2))
        found[cause] = float(np.sqrt(np.sum(common**2) / total)) if total > 0 else 0.0
    return found
