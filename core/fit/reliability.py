"""The paper's three tests for reliable samples (Ono et al. 2019, section 3.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..samples import SampleTable


def below_curvature_limit(curvature: NDArray[np.floating], threshold: float) -> NDArray[np.bool_]:
    """(n,) where the image-space mean curvature (n,), 1/pixel (equations (5)-(7),
    geometry/curvature.py), is known and at most the threshold."""
    with np.errstate(invalid="ignore"):
        return np.abs(curvature) <= threshold


def monotone_with(
    theta_h: NDArray[np.floating], rho: NDArray[np.floating], chosen: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """(n,) samples that are monotone with every chosen one: a larger n·h goes with a larger ρ
    (equation (8); Higo et al. 2010).

    theta_h, rho: (n,), rho the mean over the channels. θh replaces n·h, which in float32 is 1 for
    everything within 0.02° of the peak.
    """
    agree = np.ones(len(theta_h), bool)
    for i in chosen:
        agree &= (theta_h[i] - theta_h) * (rho - rho[i]) > 0
    return agree


def highest_intensity(table: SampleTable) -> tuple[int, SampleTable]:
    """(row, table of that one sample) of the brightest pixel, its normal replaced by the half
    vector: the paper assumes that it is the specular peak, θh = 0 (equation (9)).

    Brightest relative to its irradiance (L / E: lamps may differ in strength), among the samples
    within the margins.
    """
    row = int((table.radiance / table.irradiance).mean(axis=1).argmax())
    one = table.select(np.array([row]))
    light = one.light.astype(np.float64)
    half = light + one.view
    half = half / np.linalg.norm(half, axis=1, keepdims=True)
    angles = half_difference(half, light, one.view.astype(np.float64))
    cos_i = np.einsum("ij,ij->i", half, light)
    rho = one.radiance / (one.irradiance * cos_i[:, None])
    return row, SampleTable(
        photo=one.photo, pixel=one.pixel,
        theta_h=np.zeros(1, np.float32), theta_d=angles.theta_d.astype(np.float32),
        phi_d=angles.phi_d.astype(np.float32),
        cos_i=cos_i.astype(np.float32), cos_o=cos_i.astype(np.float32),
        rho=rho.astype(np.float32), radiance=one.radiance, variance=one.variance, point=one.point,
        normal=half.astype(np.float32),
        view=one.view, curvature=one.curvature, light=one.light, irradiance=one.irradiance,
        weight=one.weight, response=one.response,
    )  # fmt: skip
