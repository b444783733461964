"""Reflectance samples of one photo under one light (the paper, section 3.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..geometry import RayScene, SurfaceView, edges
from ..geometry.view import cast_shadow
from ..light import Incidence, Light
from ..scan import Camera
from .table import SampleTable


@dataclass(frozen=True)
class Margins:
    """What is too close to trust. silhouette, shadow, mask: pixels left out along outlines, shadow
    edges and the borders of painted masks; cosine: smallest cos θi and cos θo (0.1 is 84°: beyond,
    a degree of normal error changes the irradiance by a fifth)."""

    silhouette: int = 2
    shadow: int = 3
    mask: int = 1
    cosine: float = 0.1


@dataclass(frozen=True)
class Lighting:
    """How light falls on a SurfaceView: incidence at every pixel's point; cos_i (n,) signed;
    shadowed (n,) attached or cast."""

    incidence: Incidence
    cos_i: NDArray[np.float64]
    shadowed: NDArray[np.bool_]


def light_surface(rays: RayScene, view: SurfaceView, light: Light, camera: Camera) -> Lighting:
    """Light, irradiance cosine and shadow at every pixel's point, in the camera's photo."""
    incidence = light.incidence(view.point, camera)
    cos_i = np.einsum("ij,ij->i", view.normal, incidence.towards)
    shadowed = cos_i <= 0
    facing = np.flatnonzero(~shadowed)
    some = incidence.select(facing)
    shadowed[facing] = cast_shadow(
        rays, view.point[facing], view.normal[facing], some.towards, some.distance
    )
    return Lighting(incidence, cos_i, shadowed)


def trusted_pixels(view: SurfaceView, lighting: Lighting, margins: Margins) -> NDArray[np.bool_]:
    """(n,) lit pixels away from outlines, shadow edges and grazing angles."""
    cos_o = np.einsum("ij,ij->i", view.normal, view.view)
    lit = view.image(~lighting.shadowed, fill=0).astype(bool)
    near = np.zeros(view.shape, bool)
    if margins.silhouette > 0:
        near = edges.widen(view.silhouette, margins.silhouette - 1)
    if margins.shadow > 0:
        near = near | edges.widen(edges.shadow_edge(lit, view.seen), margins.shadow - 1)
    return (
        ~lighting.shadowed
        & (lighting.cos_i > margins.cosine)
        & (cos_o > margins.cosine)
        & ~near.ravel()[view.pixel]
    )


def sample_photo(
    view: SurfaceView,
    lighting: Lighting,
    radiance: NDArray[np.float32],
    keep: NDArray[np.bool_],
) -> SampleTable:
    """ρ = L / (E · n·l) for the pixels of ``view`` marked in ``keep`` (n,).

    radiance: (h, w, 3) linear, in the units of the light's irradiance / sr.
    """
    normal, towards = view.normal[keep], view.view[keep]
    incidence = lighting.incidence.select(keep)
    angles = half_difference(normal, incidence.towards, towards)
    seen = radiance.reshape(-1, 3)[view.pixel[keep]]
    cos_i = lighting.cos_i[keep]
    return SampleTable(
        photo=np.zeros(len(seen), np.int16),
        pixel=view.pixel[keep],
        theta_h=angles.theta_h.astype(np.float32),
        theta_d=angles.theta_d.astype(np.float32),
        phi_d=angles.phi_d.astype(np.float32),
        cos_i=cos_i.astype(np.float32),
        cos_o=np.einsum("ij,ij->i", normal, towards).astype(np.float32),
        rho=(seen / (incidence.irradiance * cos_i[:, None])).astype(np.float32),
        radiance=seen.astype(np.float32),
        normal=normal.astype(np.float32),
        view=towards.astype(np.float32),
        curvature=view.curvature[keep],
        light=incidence.towards.astype(np.float32),
        irradiance=incidence.irradiance.astype(np.float32),
    )
