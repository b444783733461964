"""Reflectance samples of one photo under one light (Ono et al. 2019, section 3.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..angles.vectors import dot
from ..geometry import RayScene, SurfaceView, edges
from ..geometry.view import cast_shadow
from ..light import Incidence, Light
from ..noise import PixelNoise
from ..scan import Camera
from .criterion import Criterion, criterion_where
from .reservoir import ALL, brightness, sample_hash
from .table import SampleTable

MIN_IRRADIANCE = 1e-30


@dataclass(frozen=True)
class Margins:
    """Distances within which a pixel is rejected. silhouette, shadow, mask: pixels from outlines,
    shadow edges and the borders of painted masks; cosine: smallest cos θi and cos θo (0.1 is 84°:
    beyond, an error of 1° in the normal changes the irradiance by a fifth)."""

    silhouette: int = 2
    shadow: int = 3
    mask: int = 1
    cosine: float = 0.1


@dataclass(frozen=True)
class Lighting:
    """The light on a SurfaceView: incidence at every pixel's point; cos_i (n,) float32, negative
    where the surface faces away; shadowed (n,) by an attached or cast shadow."""

    incidence: Incidence
    cos_i: NDArray[np.float32]
    shadowed: NDArray[np.bool_]


def light_surface(rays: RayScene, view: SurfaceView, light: Light, camera: Camera) -> Lighting:
    """Incidence, cos θi and shadow at every pixel's point of a view."""
    incidence = light.incidence(view.point, camera)
    cos_i = dot(_single(view.normal), _single(incidence.towards))
    shadowed = cos_i <= 0
    facing = np.flatnonzero(~shadowed)
    some = incidence.select(facing)
    shadowed[facing] = cast_shadow(
        rays,
        _gathered(view.point, facing),
        _gathered(view.normal, facing),
        some.towards,
        some.distance,
    )
    return Lighting(incidence, cos_i, shadowed)


def halo(margins: Margins) -> int:
    """Rows around a window that margins, outlines and curvature depend on."""
    return max(1, margins.silhouette, margins.shadow, margins.mask)


def light_criteria(view: SurfaceView, lighting: Lighting, margins: Margins) -> NDArray[np.uint8]:
    """(n,) the Criterion of each pixel as far as light and view decide: shadows and their edges,
    outlines, grazing angles; RELIABLE elsewhere."""
    near = np.full(view.shape, Criterion.RELIABLE, np.uint8)
    if margins.silhouette > 0:
        outline = edges.widen(view.silhouette, margins.silhouette - 1)
        near = criterion_where(Criterion.OUTLINE, outline)
    if margins.shadow > 0:
        lit = view.image(~lighting.shadowed, fill=0)
        edge = edges.widen(edges.shadow_edge(lit, view.seen), margins.shadow - 1)
        np.minimum(near, criterion_where(Criterion.SHADOW_EDGE, edge), out=near)
    found = view.at(near)
    steep = (lighting.cos_i > margins.cosine) & (dot(view.normal, view.view) > margins.cosine)
    for criterion, pixels in (
        (Criterion.GRAZING, ~steep),
        (Criterion.CAST_SHADOW, lighting.shadowed),
        (Criterion.TURNED_AWAY, lighting.cos_i <= 0),
    ):
        np.minimum(found, criterion_where(criterion, pixels), out=found)
    return found


def trusted_pixels(view: SurfaceView, lighting: Lighting, margins: Margins) -> NDArray[np.bool_]:
    """(n,) lit pixels away from outlines, shadow edges and grazing angles."""
    return light_criteria(view, lighting, margins) == Criterion.RELIABLE


def inner_pixels(
    view: SurfaceView, pixels: NDArray[np.bool_], margins: Margins
) -> NDArray[np.bool_]:
    """(n,) those of the pixels (n,) of a mask that are not near its borders with other surface."""
    if margins.mask <= 0 or pixels.all():
        return pixels
    part = view.image(pixels, fill=0)
    return view.at(edges.inside(part, view.seen, margins.mask))


def deciding_criteria(
    view: SurfaceView,
    lighting: Lighting,
    margins: Margins,
    materials: Sequence[NDArray[np.bool_]],
    left_out: Sequence[tuple[Criterion, NDArray[np.bool_]]],
    usable: NDArray[np.bool_],
    calm: NDArray[np.bool_] | None = None,
) -> NDArray[np.uint8]:
    """(n,) the Criterion of each pixel of a view.

    materials: (n,) pixels of each; left_out: (criterion, (n,) pixels) of masks; usable: (n,)
    neither clipped nor otherwise lost in the photo; calm: (n,) below the curvature limit, None for
    no limit. A pixel of several materials is at a mask border where it is so in all of them.
    """
    some = np.zeros(len(view.pixel), bool)
    inner = some.copy()
    for pixels in materials:
        some |= pixels
        inner |= inner_pixels(view, pixels, margins)
    reached = _reached(_single(lighting.incidence.irradiance))
    rejections = [
        (Criterion.NO_MATERIAL, ~some),
        *left_out,
        (Criterion.MASK_BORDER, ~inner),
        (Criterion.UNUSABLE, ~usable),
        (Criterion.OUTSIDE_BEAM, ~reached),
    ]
    if calm is not None:
        rejections.append((Criterion.CURVED, ~calm))
    found = light_criteria(view, lighting, margins)
    for criterion, pixels in rejections:
        np.minimum(found, criterion_where(criterion, pixels), out=found)
    return found


def sample_photo(
    view: SurfaceView,
    lighting: Lighting,
    radiance: NDArray[np.float32],
    keep: NDArray[np.bool_],
    photo: int = 0,
    noise: PixelNoise | None = None,
) -> SampleTable:
    """ρ = L / (E · n·l) for the pixels of ``view`` marked in ``keep`` (n,).

    radiance: (h, w, 3) of the whole photo, linear, in the units of the light's irradiance / sr.
    photo: index written to the table. noise: of the photo, None for none. Pixels that almost no
    light reaches are skipped (reached_rows).
    """
    rows = reached_rows(lighting, keep)
    return sample_rows(view, lighting, radiance, rows, photo, noise)


def reached_rows(lighting: Lighting, keep: NDArray[np.bool_]) -> NDArray[np.intp]:
    """The rows of a view that are marked in ``keep`` (n,) and that light reaches. Outside a narrow
    beam the reflectance cannot be represented in single precision."""
    rows = np.flatnonzero(keep)
    reached = _reached(_single(lighting.incidence.select(rows).irradiance))
    if reached.all():
        return rows
    return rows[reached] if len(reached) == len(rows) else rows[:0]


def rows_below(
    limit: np.uint64,
    view: SurfaceView,
    lighting: Lighting,
    radiance: NDArray[np.float32],
    rows: NDArray[np.intp],
    photo: int,
) -> NDArray[np.intp]:
    """Those of some rows that a reservoir of this limit keeps (SampleReservoir.limit): those whose
    hash is at most the limit, and the one with the largest mean of L / E. All other columns of a
    sample are then computed for few of them."""
    if limit == ALL or not len(rows):
        return rows
    pixel = view.pixel.take(rows)
    kept = sample_hash(np.full(len(rows), photo), pixel) <= limit
    irradiance = _single(lighting.incidence.select(rows).irradiance)
    seen = radiance.reshape(-1, 3).take(pixel, axis=0)
    kept[np.argmax(brightness(seen, irradiance))] = True
    return rows[kept]


def sample_rows(
    view: SurfaceView,
    lighting: Lighting,
    radiance: NDArray[np.float32],
    rows: NDArray[np.intp],
    photo: int = 0,
    noise: PixelNoise | None = None,
) -> SampleTable:
    """sample_photo of some rows of the view, all of which light reaches."""
    normal, towards = (_gathered(_single(v), rows) for v in (view.normal, view.view))
    incidence = lighting.incidence.select(rows)
    light, irradiance = _single(incidence.towards), _single(incidence.irradiance)
    angles = half_difference(normal, light, towards)
    cos_i = lighting.cos_i.take(rows)
    pixel = view.pixel.take(rows)
    seen = radiance.reshape(-1, 3).take(pixel, axis=0)
    rho = np.empty_like(seen)
    for channel in range(3):
        rho[:, channel] = seen[:, channel] / (irradiance[:, channel] * cos_i)
    n = len(rows)
    return SampleTable(
        photo=np.full(n, photo, np.int16),
        pixel=pixel,
        theta_h=angles.theta_h,
        theta_d=angles.theta_d,
        phi_d=angles.phi_d,
        cos_i=cos_i,
        cos_o=dot(normal, towards),
        rho=rho,
        radiance=seen,
        variance=np.zeros_like(seen) if noise is None else noise.at(pixel, seen),
        point=_gathered(view.point, rows),
        normal=normal,
        view=towards,
        curvature=view.curvature.take(rows),
        light=np.broadcast_to(light, (n, 3)),
        irradiance=np.broadcast_to(irradiance, (n, 3)),
        weight=np.broadcast_to(np.float32(1), n),
        response=np.broadcast_to(np.float32(1), (n, 3)),
    )


def _reached(irradiance: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(n,), or (1,) for all: where the irradiance is large enough for a reflectance in single
    precision."""
    return (irradiance > MIN_IRRADIANCE).all(axis=1)


def _single(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """(n, 3) in float32; (1, 3) where one row applies to all."""
    if len(values) and values.strides[0] == 0:
        values = values[:1]
    return values.astype(np.float32, copy=False)


def _gathered(values: NDArray[np.floating], rows: NDArray[np.intp]) -> NDArray[np.floating]:
    """(m, 3) rows in component-major memory order: three long rows are read faster than many short
    ones."""
    out = np.empty((3, len(rows)), values.dtype)
    for axis in range(3):
        out[axis] = values[:, axis].take(rows)
    return out.T
