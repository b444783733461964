"""Coordinates of a pixel that can reveal a cause, and the trend of the residual along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import dot
from ..forward.diagnosis_context import DiagnosisContext
from ..forward.pixels import Pixels
from ..forward.shading_state import ShadingState
from ..forward.tangent_directions import tangential_axes, tangential_half_vector
from .weighted_means import weighted_means

Array = NDArray[np.floating]

BINS, MIN_PIXELS = 12, 40  # of a coordinate; pixels that a bin needs
UPRIGHT = np.radians(2.0)  # θh below which the half vector has no direction on the surface


@dataclass(frozen=True)
class Coordinate:
    """One coordinate of all pixels, for example the half angle. values: (n,) in ``unit``, NaN where
    unknown."""

    name: str
    unit: str
    values: Array


@dataclass(frozen=True)
class Trend:
    """The residual (photo minus prediction) along a coordinate, relative to the prediction.

    at: (b,) median coordinate of each bin. mean: (b,) weighted by the inverse variance of pixels.
    error: (b,) standard errors, with regions of the photos as independent units."""

    at: Array
    mean: Array
    error: Array


def coordinates(context: DiagnosisContext) -> list[Coordinate]:
    """Every coordinate of the diagnosis's pixels along which the residual is charted."""
    pixels = context.pixels
    now = ShadingState.of(pixels)
    angles = now.angles
    cos_o = dot(pixels.normal, pixels.view)
    cos_i = dot(pixels.normal, pixels.light)
    open_ = context.surroundings.share * context.surroundings.open
    place = pixels.point - context.centre
    degrees = [
        ("half angle θh", angles.theta_h), ("difference angle θd", angles.theta_d),
        ("angle of incidence θi", np.arccos(np.clip(cos_i, -1, 1))),
        ("angle of view θo", np.arccos(np.clip(cos_o, -1, 1))),
    ]  # fmt: skip
    found = [Coordinate(name, "°", np.degrees(values)) for name, values in degrees]
    found += [
        Coordinate(
            "distance from the photo's centre", "half diagonals", np.hypot(pixels.x, pixels.y)
        ),
        Coordinate("photo", "", pixels.photo + 1.0),
        Coordinate("brightness", "log10", np.log10(np.maximum(pixels.observed.mean(axis=1), 1e-6))),
        Coordinate("curvature", "1/pixel", pixels.curvature),
        Coordinate("distance to a shadow's edge", "pixels", pixels.edge),
        Coordinate("open part of the surroundings", "", open_.sum(axis=1) / np.pi),
        Coordinate("towards the lamp", "scan units", np.einsum("ij,ij->i", place, pixels.light)),
    ]
    found += [
        Coordinate(f"position on the object, {'xyz'[k]}", "scan units", place[:, k])
        for k in range(3)
    ]
    turns = half_vector_turns(pixels)
    found += [Coordinate(f"tangent direction, off {'xyz'[k]}", "°", turns[:, k]) for k in range(3)]
    return found


def half_vector_turns(pixels: Pixels) -> Array:
    """(n, 3) angles in the tangent plane between the half vector and each of the scan's axes,
    degrees, 0 to 90; anisotropic reflection depends on them. NaN where the half vector or the axis
    is nearly normal to the surface."""
    normal = pixels.normal.astype(np.float64)
    flat, axes = tangential_half_vector(normal, pixels.light, pixels.view), tangential_axes(normal)
    sizes = np.linalg.norm(flat, axis=1)[:, None], np.linalg.norm(axes, axis=2)
    along = np.abs(np.einsum("nax,nx->na", axes, flat)) / np.maximum(sizes[0] * sizes[1], 1e-12)
    there = (sizes[0] > np.sin(UPRIGHT)) & (sizes[1] > np.sin(UPRIGHT))
    return np.where(there, np.degrees(np.arccos(np.clip(along, 0, 1))), np.nan)


def trend(
    coordinate: Coordinate,
    residual: Array,
    shown: Array,
    deviation: Array,
    block: NDArray[np.int32],
) -> Trend:
    """The trend of the residual along a coordinate. residual: (n, 3) photo minus prediction; shown:
    (n, 3) prediction; deviation: (n, 3) standard deviation of the residual; block: (n,) region of
    each pixel."""
    known = np.isfinite(coordinate.values) & np.isfinite(deviation).all(axis=1)
    known &= shown.mean(axis=1) > 0
    values = coordinate.values[known]
    if not len(values):  # for example a tangent direction on a flat surface
        return Trend(np.zeros(0), np.zeros(0), np.zeros(0))
    edges = np.unique(np.quantile(values, np.linspace(0, 1, BINS + 1)))
    which = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, max(len(edges) - 2, 0))
    bins = max(len(edges) - 1, 1)
    each = residual[known] / deviation[known], shown[known], deviation[known], block[known]
    means = weighted_means(which, bins, MIN_PIXELS, *each)
    used = np.flatnonzero(np.isfinite(means.mean))
    at = np.array([np.median(values[which == k]) for k in used])
    return Trend(at, means.mean[used], means.error[used])
