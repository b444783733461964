"""Observations of a surface as the samples that estimators and corrections read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..samples import SampleTable
from .observations import Observations

MIN_COSINE = 0.1  # of the light, in the reflectance
RELATIVE_NOISE = 0.02  # of the radiance, that is assumed at least


def samples_of(
    seen: Observations,
    pixel: NDArray[np.int32],
    points: NDArray[np.float64],
    normals: NDArray[np.float32],
    scale: float | NDArray[np.float32],
) -> SampleTable:
    """One sample for each of m observations. pixel: (m,) of its photo; points, normals: (m, 3) of
    its node; scale: factor of the photos' reflectance in the fit, one or (m, 1)."""
    n = len(seen)
    cos_i, cos_o = (np.einsum("ij,ij->i", normals, v) for v in (seen.light, seen.view))
    angles = half_difference(normals, seen.light, seen.view)
    irradiance = seen.irradiance / np.float32(scale)
    return SampleTable(
        photo=seen.photo,
        pixel=pixel,
        theta_h=angles.theta_h,
        theta_d=angles.theta_d,
        phi_d=angles.phi_d,
        cos_i=cos_i,
        cos_o=cos_o,
        rho=seen.radiance / (irradiance * np.maximum(cos_i, MIN_COSINE)[:, None]),
        radiance=seen.radiance,
        variance=np.square(RELATIVE_NOISE * seen.radiance),
        point=points,
        normal=normals,
        view=seen.view,
        curvature=np.zeros(n, np.float32),
        light=seen.light,
        irradiance=irradiance,
        weight=np.ones(n, np.float32),
        response=np.ones((n, 3), np.float32),
    )
