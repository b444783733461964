"""Refine a sphere's outline in a photo with sub-pixel accuracy, along radial profiles."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, optimize

from ..errors import InputError
from ..scan.camera import Camera
from .sphere_outline import Sphere, fit_sphere, pixel_radius
from .sphere_rim import SHIFTS, best_blur, unexplained

Array = NDArray[np.float64]

PROFILES = 240  # radial profiles around the outline
COARSE_RADIUS = 100.0  # pixels: the first refinement of a larger sphere has this resolution
STEP = 0.5  # pixels along a profile
EDGES_PER_PROFILE = 5  # the strongest
OUTWARD_WEIGHT = 2.0  # relative gain in votes of a cone that is wider by its own half-angle
VOTE_STEP = 0.015  # of the radius: bin width of the votes
CANDIDATES = 12  # cones with most votes, which are refined
MIN_SEPARATION = 0.02  # of the radius, between two candidates
MAX_EDGE_DISTANCE = 1.2  # pixels between an edge and a cone that it supports
WINDOW = 3.0  # pixels on either side of the outline when it is refined,
RIM_WIDTH = 0.045  # or this share of the radius, whichever is larger
MIN_SUPPORT = 0.35  # of the profiles
MAX_UNEXPLAINED = 0.2  # of a profile's variance: above it the profile shows no edge
MIN_UNEXPLAINED = 0.01  # the same: below it all edges count as equally clear
# of the radius: no search is that wide, but a cone of 180° seen through distortion can be
# millions of pixels wide, and its profiles take half a minute
MAX_GROWTH = 3.0
RIM_BIAS = 0.05  # pixels: error left by the rim model, measured on rendered spheres
MAX_GAP = np.radians(150.0)  # of azimuth without support
MIN_EDGE_STRENGTH = 4.0  # times the median gradient of its profile


@dataclass(frozen=True)
class RefinedOutline:
    """An outline fitted to edges in the photo. sphere: the fit. support: share of the profiles with
    an edge on the outline. rms: distance of these edges from it, pixels. score: how well the rim
    model fits, 0 (nowhere) … 4.6 (all around). sigma: (3,) standard errors of (across, down, wider)
    as in Sphere.moved."""

    sphere: Sphere
    support: float
    rms: float
    score: float
    sigma: Array


def refine_outline(
    pixels: NDArray, camera: Camera, sphere: Sphere, search: float = 0.2
) -> RefinedOutline | None:
    """Find the outline near ``sphere`` that the edges in the photo support; None where they do not.

    pixels: (h, w, 3) linear. search: width of the search on either side, in radii. The strongest
    gradients of radial profiles vote for cones of rays (Hough transform). The mirrored scene has
    edges near the rim too, but not on a cone. Each candidate is therefore refined with the rim
    model (sphere_rim.py) in all profiles at once, and the one with the best fit is returned.
    """
    picture = np.asarray(pixels, float).sum(axis=2)
    # the votes are coarse for a large sphere, so the first refinement is coarse too
    radius = pixel_radius(sphere, camera)
    unit = max(1.0, radius / COARSE_RADIUS)
    tried = [
        _fit_rim(picture, camera, start, unit)
        for start in _vote_for_cones(picture, camera, sphere, search)
        if pixel_radius(start, camera) < MAX_GROWTH * radius
    ]
    found = [outline for outline in tried if outline is not None]
    # repeat at a finer resolution, starting from the result
    for keep in (3, 1, 1):
        found = sorted(found, key=lambda outline: -outline.score)[:keep]
        unit = max(1.0, unit / 3)
        found = [_fit_rim(picture, camera, outline.sphere, unit) or outline for outline in found]
    return found[0] if found else None


def _profiles(
    picture: Array, camera: Camera, sphere: Sphere, half_width: float, step: float = STEP
) -> tuple[Array, Array, Array]:
    """(azimuths (n,), offsets (k,) in pixels outward, values (n, k), NaN outside the photo)."""
    radius = pixel_radius(sphere, camera)
    azimuths = np.arange(PROFILES) / PROFILES * 2 * np.pi
    offsets = np.arange(-half_width, half_width + step / 2, step)
    scales = 1 + offsets / radius
    turn, scale = np.repeat(azimuths, len(offsets)), np.tile(scales, len(azimuths))
    places = sphere.outline(camera, turn, scale)
    values = ndimage.map_coordinates(
        picture, [places[:, 1] - 0.5, places[:, 0] - 0.5], order=1, cval=np.nan, prefilter=False
    )
    return azimuths, offsets, values.reshape(len(azimuths), len(offsets))


def _vote_for_cones(picture: Array, camera: Camera, sphere: Sphere, search: float) -> list[Sphere]:
    """Candidate spheres near ``sphere``, by a Hough transform of the edges, most votes first."""
    radius = pixel_radius(sphere, camera)
    if not np.isfinite(radius):
        return []
    azimuths, offsets, values = _profiles(picture, camera, sphere, max(4.0, search * radius))
    inside = values[np.isfinite(values)]
    if inside.size == 0:
        return []
    # compress the range, so that a highlight's edge is not stronger than the outline
    middle = np.median(inside)
    soft = values / (np.abs(values) + max(middle, 1e-3 * np.max(np.abs(inside)), 1e-30))
    slope = np.abs(ndimage.gaussian_filter1d(soft, 2.0, axis=1, order=1))
    slope = np.nan_to_num(slope)
    peak = (slope[:, 1:-1] >= slope[:, :-2]) & (slope[:, 1:-1] > slope[:, 2:])
    strength = np.where(peak, slope[:, 1:-1], 0.0)
    floor = MIN_EDGE_STRENGTH * np.median(slope, axis=1, keepdims=True)
    strength = np.where(strength > np.maximum(floor, 1e-4), strength, 0.0)
    order = np.argsort(-strength, axis=1)[:, :EDGES_PER_PROFILE]
    weight = np.take_along_axis(strength, order, axis=1)
    places = offsets[1 + order]
    with_edge = np.nonzero(weight[:, 0] > 0)[0]
    if len(with_edge) < MIN_SUPPORT * PROFILES:
        return []
    limit = np.median(weight[with_edge, 0])
    # a chrome sphere mirrors its table at the rim, so faint edges get nearly the same vote
    vote = np.sqrt(np.minimum(weight / limit, 1.0))
    # an outline moved by (x, y) and widened by w crosses azimuth t at
    # x cos t + y sin t + w − (x sin t − y cos t)² / 2R, so an edge there gives w for each (x, y)
    step = max(1.0, VOTE_STEP * radius)
    reach = float(offsets[-1])
    shifts = np.arange(-reach, reach + step / 2, step)
    x, y = (axis.reshape(-1, 1, 1) for axis in np.meshgrid(shifts, shifts, indexing="ij"))
    cos, sin = np.cos(azimuths)[None, :, None], np.sin(azimuths)[None, :, None]
    wider = places[None] - (x * cos + y * sin) + (x * sin - y * cos) ** 2 / (2 * radius)
    column = np.round((wider + reach) / step).astype(int)
    bins = round(2 * reach / step) + 1
    usable = (column >= 0) & (column < bins) & (vote[None] > 0)
    place = np.arange(len(x))[:, None, None] * bins + column
    votes = np.bincount(
        place[usable], np.broadcast_to(vote[None], place.shape)[usable], len(x) * bins
    )
    score = ndimage.gaussian_filter(votes.reshape(len(shifts), len(shifts), bins), 0.7)
    widths = np.arange(bins) * step - reach
    # prefer wide cones: edges of the mirrored scene are inside the outline
    score *= np.maximum(1 + OUTWARD_WEIGHT * widths / radius, 0.1)
    found = []
    spaced = max(1, round(MIN_SEPARATION * radius / step))
    for _ in range(CANDIDATES):
        i, j, k = (int(n) for n in np.unravel_index(int(np.argmax(score)), score.shape))
        if not score[i, j, k] > 0:
            break
        shift = (shifts[i] / radius, shifts[j] / radius, widths[k] / radius)
        with contextlib.suppress(InputError):
            found.append(fit_sphere(camera, _shifted(sphere, camera, azimuths, shift)))
        score[
            max(0, i - spaced) : i + spaced + 1,
            max(0, j - spaced) : j + spaced + 1,
            max(0, k - spaced) : k + spaced + 1,
        ] = 0.0
    return found


def _shifted(
    sphere: Sphere, camera: Camera, azimuths: Array, shift: tuple[float, float, float]
) -> Array:
    """(n, 2) pixels of the outline after a shift (x, y) and a widening, in radii."""
    x, y, wider = shift
    cos, sin = np.cos(azimuths), np.sin(azimuths)
    scale = 1 + x * cos + y * sin + wider - (x * sin - y * cos) ** 2 / 2
    return sphere.outline(camera, azimuths, scale)


def _fit_rim(
    picture: Array, camera: Camera, sphere: Sphere, unit: float = 1.0
) -> RefinedOutline | None:
    """Fit the cone to all profiles at once, minimising the variance that the rim model leaves.

    unit: resolution, in pixels; the start must be within 2 units of the outline. None where too
    few profiles show an edge.
    """
    radius = pixel_radius(sphere, camera) / unit
    if not np.isfinite(radius):
        return None
    reach = max(WINDOW, RIM_WIDTH * radius)
    azimuths, offsets, values = _profiles(picture, camera, sphere, reach * unit, STEP * unit)
    offsets = offsets / unit
    good = np.isfinite(values).all(axis=1)
    if not _covers(good):
        return None
    turn, values = azimuths[good], values[good]
    left = unexplained(offsets, values, radius, best_blur(offsets, values, radius))
    rows = np.stack([np.cos(turn), np.sin(turn), np.ones(len(turn))], axis=1)
    # the logarithm gives weight to clear edges and little to differences between unclear ones
    misfit = np.log(left + MIN_UNEXPLAINED)
    which = np.arange(len(turn))

    def cost(shift: Array) -> float:
        place = (rows @ shift - SHIFTS[0]) / (SHIFTS[1] - SHIFTS[0])
        place = np.clip(place, 0, len(SHIFTS) - 1.001)
        low = place.astype(int)
        part = place - low
        return float(np.sum(misfit[which, low] * (1 - part) + misfit[which, low + 1] * part))

    corners = 0.4 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    tried = [
        optimize.minimize(
            cost, start, method="Nelder-Mead",
            options={"initial_simplex": start + corners, "xatol": 0.005, "fatol": 1e-4},
        )
        for start in (np.zeros(3), np.array([-0.2, -0.2, -0.3]))
    ]  # fmt: skip
    least = min(tried, key=lambda result: result.fun)
    best, score = least.x, -float(least.fun) / PROFILES
    try:
        fit = fit_sphere(camera, sphere.outline(camera, turn, 1 + rows @ best / radius))
    except InputError:
        return None
    places = SHIFTS[np.argmin(left, axis=1)]
    miss = places - rows @ best
    on_it = (left.min(axis=1) < MAX_UNEXPLAINED) & (np.abs(miss) < MAX_EDGE_DISTANCE)
    hit = np.zeros(PROFILES, bool)
    hit[np.nonzero(good)[0][on_it]] = True
    if not _covers(hit):
        return None
    rms = float(np.sqrt(np.mean(miss[on_it] ** 2)))
    # neighbouring profiles share pixels: the number of independent profiles is that of the pixels
    fewer = max(1.0, PROFILES / (2 * np.pi * radius))
    spread = np.linalg.inv(rows[on_it].T @ rows[on_it]) * (rms**2 * fewer)
    return RefinedOutline(
        fit, float(hit.mean()), rms * unit, score, np.sqrt(np.diag(spread) + RIM_BIAS**2) / radius
    )


def _covers(hit: NDArray[np.bool_]) -> bool:
    """Whether the profiles cover enough of the outline, without a gap wider than MAX_GAP."""
    if hit.mean() < MIN_SUPPORT:
        return False
    places = np.nonzero(hit)[0]
    gaps = np.diff(np.append(places, places[0] + len(hit)))
    return bool(gaps.max() * 2 * np.pi / len(hit) < MAX_GAP)
