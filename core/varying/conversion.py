"""Observations of a surface that varies, converted to samples of its typical material.

A fit of one BRDF mixes the differences between points of the surface into the shape of the lobe.
Every radiance is therefore multiplied by the ratio of the model with median parameters to the model
with the node's own; the node's tilted normal stays. A fit of these samples is the BRDF without the
variation (Lensch et al. 2003 alternate in the same way between clusters and points).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..samples import SampleTable
from .node_model import TILT, NodeModel, tilted
from .observation_samples import MIN_COSINE, samples_of
from .observations import Observations

MAX_SAMPLES = 60_000  # of a regular subset: more do not change the BRDF
MIN_FACTOR, MAX_FACTOR = 0.02, 50.0  # of the radiance


def typical_parameters(seen: Observations, parameters: NDArray[np.float32]) -> NDArray[np.float32]:
    """(10,) of the typical material: medians over the nodes that are seen. parameters: (n, 10)."""
    return np.asarray(np.median(parameters[np.unique(seen.node)], axis=0), np.float32)


def sampling_step(count: int) -> int:
    """The step of a regular subset of ``count`` observations with at most MAX_SAMPLES. Measured and
    clipped observations of a fit need one step: their numbers in a cell say how much of it is
    clipped."""
    return max(-(-count // MAX_SAMPLES), 1)


def typical_samples(
    model: NodeModel,
    seen: Observations,
    points: NDArray[np.float64],
    normals: NDArray[np.float32],
    parameters: NDArray[np.float32],
    typical: NDArray[np.float32],
    step: int = 1,
) -> SampleTable:
    """Samples of the typical material, in the scale of ``model``. Clipped channels have response 0:
    their radiance is a lower limit. points, normals: (n, 3) of the nodes; parameters: (n, 10);
    typical: (10,); step: every so many of the observations are converted."""
    some = seen.select(np.arange(0, len(seen), step))
    own = parameters[some.node]
    typical = np.tile(typical, (len(own), 1))
    typical[:, TILT] = own[:, TILT]
    normal = normals[some.node]
    factor = model.radiance(some.shading, normal, typical) / np.maximum(
        model.radiance(some.shading, normal, own), 1e-12
    )
    radiance = some.radiance * np.clip(factor, MIN_FACTOR, MAX_FACTOR)
    normal = tilted(normal, own)
    pixel = np.arange(len(some), dtype=np.int32)
    converted = replace(some, radiance=radiance)
    table = samples_of(converted, pixel, points[some.node], normal, model.scale)
    table = replace(table, response=(~some.clipped).astype(np.float32))
    return table.select(np.flatnonzero((table.cos_i > MIN_COSINE) & (table.cos_o > MIN_COSINE)))
