"""Observations of a surface that varies, converted to samples of its typical material.

A fit of one BRDF mixes the differences between points of the surface into the shape of the lobe.
Every radiance is therefore multiplied by the ratio of the model with median parameters to the model
with the node's own; the node's tilted normal stays. A fit of these samples is the BRDF without the
variation (Lensch et al. 2003 alternate in the same way between clusters and points).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..samples import SampleTable
from .node_model import TILT, NodeModel, tilted
from .observations import Observations

MAX_SAMPLES = 60_000  # of a regular subset: more do not change the BRDF
MIN_FACTOR, MAX_FACTOR = 0.02, 50.0  # of the radiance
MIN_COSINE = 0.1  # of light and view
RELATIVE_NOISE = 0.02  # of the converted radiance, that the estimator assumes at least


def typical_samples(
    model: NodeModel,
    seen: Observations,
    points: NDArray[np.float64],
    normals: NDArray[np.float32],
    parameters: NDArray[np.float32],
) -> SampleTable:
    """Samples of the typical material, in the scale of ``model``. points, normals: (n, 3) of the
    nodes; parameters: (n, 8)."""
    step = -(-len(seen) // MAX_SAMPLES)
    some = seen.select(np.arange(0, len(seen), max(step, 1)))
    own = parameters[some.node]
    typical = np.tile(np.median(parameters[np.unique(seen.node)], axis=0), (len(own), 1))
    typical[:, TILT] = own[:, TILT]
    normal = normals[some.node]
    factor = model.radiance(some.shading, normal, typical) / np.maximum(
        model.radiance(some.shading, normal, own), 1e-12
    )
    radiance = some.radiance * np.clip(factor, MIN_FACTOR, MAX_FACTOR)
    normal = tilted(normal, own)
    cos_i, cos_o = (np.einsum("ij,ij->i", normal, v) for v in (some.light, some.view))
    angles = half_difference(normal, some.light, some.view)
    irradiance = some.irradiance / np.float32(model.scale)
    n = len(some)
    table = SampleTable(
        photo=some.photo,
        pixel=np.arange(n, dtype=np.int32),
        theta_h=angles.theta_h,
        theta_d=angles.theta_d,
        phi_d=angles.phi_d,
        cos_i=cos_i,
        cos_o=cos_o,
        rho=radiance / (irradiance * np.maximum(cos_i, MIN_COSINE)[:, None]),
        radiance=radiance,
        variance=np.square(RELATIVE_NOISE * radiance),
        point=points[some.node],
        normal=normal,
        view=some.view,
        curvature=np.zeros(n, np.float32),
        light=some.light,
        irradiance=irradiance,
        weight=np.ones(n, np.float32),
        response=np.ones((n, 3), np.float32),
    )
    return table.select(np.flatnonzero((cos_i > MIN_COSINE) & (cos_o > MIN_COSINE)))
