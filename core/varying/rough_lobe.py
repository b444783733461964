"""The part of a diffuse colour that may be the lobe of a rough surface.

The lobe of a dielectric so rough that its GGX roughness α is 1 has no highlight: its distribution
of normals is D = 1 / π, its visibility (Smith, of correlated heights) 1 / (2 (cos θi + cos θo)), so
that its reflectance F / (2 π (cos θi + cos θo)) looks like a diffuse albedo of F0 / 4 at normal
incidence, and of more elsewhere. Photos do not tell the two apart, and where dust or dirt lies on a
glossy paint the lobe of the material is not that of the place. A dark colour is therefore known
less well, relative to itself, than a bright one.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..appearance.layer_albedo import F0_OF_GLASS, fresnel_dielectric, ior_from_f0
from .node_model import COUNT, DIFFUSE, NodeModel
from .split import directions

MIN_ALBEDO = 1e-3  # of a node, to limit its relative error


@cache
def rough_lobe_albedo() -> float:
    """The standard error of a diffuse albedo from a lobe that looks diffuse: the albedo that the
    roughest lobe of glass seems to have, the mean over light and view near the normal."""
    light, view = directions()
    half = light + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    fresnel = fresnel_dielectric(np.sum(half * view, axis=1), ior_from_f0(F0_OF_GLASS))
    return float(np.mean(fresnel / (2 * (light[:, 2] + view[:, 2]))))


def rough_lobe_variance(model: NodeModel, parameters: NDArray[np.floating]) -> NDArray[np.float32]:
    """(n, 10) variances of the parameters (n, 10) of nodes from a lobe that looks diffuse: those of
    the diffuse colour; 0 for a material whose diffuse part reflects almost nothing."""
    found = np.zeros((len(parameters), COUNT), np.float32)
    if not model.mostly_specular:
        albedo = np.pi * model.body / model.scale * np.exp(parameters[:, DIFFUSE])
        found[:, DIFFUSE] = np.square(rough_lobe_albedo() / np.maximum(albedo, MIN_ALBEDO))
    return found
