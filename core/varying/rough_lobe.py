"""The part of a diffuse colour that may be the lobe of a rough surface.

The lobe of a dielectric so rough that its Beckmann or GGX roughness α is 1 has no highlight: at
normal incidence D F / 4 = F0 / (4 π α²), which looks like a diffuse albedo of F0 / 4. Photos do not
tell the two apart, and where dust or dirt lies on a glossy paint the lobe of the material is not
that of the place. A dark colour is therefore known less well, relative to itself, than a bright
one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..appearance.layer_albedo import F0_OF_GLASS
from .node_model import COUNT, DIFFUSE, NodeModel

ROUGH_LOBE_ALBEDO = F0_OF_GLASS / 4
"""Standard error of a diffuse albedo from a lobe that looks diffuse."""
MIN_ALBEDO = 1e-3  # of a node, to limit its relative error


def rough_lobe_variance(model: NodeModel, parameters: NDArray[np.floating]) -> NDArray[np.float32]:
    """(n, 10) variances of the parameters (n, 10) of nodes from a lobe that looks diffuse: those of
    the diffuse colour; 0 for a material without a diffuse part."""
    found = np.zeros((len(parameters), COUNT), np.float32)
    if model.has_body:
        albedo = np.pi * model.body / model.scale * np.exp(parameters[:, DIFFUSE])
        found[:, DIFFUSE] = np.square(ROUGH_LOBE_ALBEDO / np.maximum(albedo, MIN_ALBEDO))
    return found
