"""The sphere's outline in the photo: found along radial profiles, to a fraction of a pixel."""

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

PROFILES = 240
COARSE = 100.0  # pixels of radius: a larger sphere is looked at as if it were this large, first
STEP = 0.5  # pixels along a profile
CANDIDATES = 5  # edges kept of a profile
OUTWARD = 2.0  # how much a cone wider by its own half-angle is preferred
FINENESS = 0.015  # of the radius: steps of the votes for a cone
CONES = 12  # with most votes, that are refined
APART = 0.02  # of the radius: cones nearer to each other are one
NEAR = 1.2  # pixels: an edge this near supports a cone
WINDOW = 3.0  # pixels on either side of the outline, when it is refined,
RIM_WIDTH = 0.045  # or this many radii
LEAST_SUPPORT = 0.35  # of the profiles
MOST_LEFT = 0.2  # of a profile's variance that is not the rim's: above it no edge is seen there
CLEAREST = 0.01  # the same: below it an edge is as good as it gets
BIAS = 0.05  # pixels: what the shape of the rim leaves, measured on rendered spheres
WIDEST_GAP = np.radians(150.0)  # of azimuth without support
STRONGER = 4.0  # times the median gradient of its profile: what counts as an edge


@dataclass(frozen=True)
class RefinedOutline:
    """sphere: the fit. support: share of the profiles with an edge on it. rms: of those edges from
    it, pixels. worth: how much it looks like a sphere's rim, 0 (nowhere) … 4.6 (all around).
    sigma: (3,) standard errors of (across, down, wider) as in Sphere.moved."""

    sphere: Sphere
    support: float
    rms: float
    worth: float
    sigma: Array


def refine_outline(
    pixels: NDArray, camera: Camera, sphere: Sphere, search: float = 0.2
) -> RefinedOutline | None:
    """The outline near ``sphere`` that the photo's edges agree on; None where they do not.

    pixels: (h, w, 3) linear. search: how far from it to look, in radii. Profiles across it, whose
    strongest gradients vote for a cone of rays (Hough transform). What the sphere mirrors has edges
    near its rim too, but on no cone: each candidate is refined, by the rim's shape (sphere_rim.py)
    in all profiles at once, and the one that this shape explains best is the outline.
    """
    picture = np.asarray(pixels, float).sum(axis=2)
    # the votes are as coarse as the sphere is large: so is the first look at what they found
    unit = max(1.0, pixel_radius(sphere, camera) / COARSE)
    tried = [
        _by_rim(picture, camera, start, unit)
        for start in _by_consensus(picture, camera, sphere, search)
    ]
    found = [outline for outline in tried if outline is not None]
    # each time nearer to it, the rim's shape is laid across the outline more exactly
    for keep in (3, 1, 1):
        found = sorted(found, key=lambda outline: -outline.worth)[:keep]
        unit = max(1.0, unit / 3)
        found = [_by_rim(picture, camera, outline.sphere, unit) or outline for outline in found]
    return found[0] if found else None


def _profiles(
    picture: Array, camera: Camera, sphere: Sphere, half_width: float, step: float = STEP
) -> tuple[Array, Array, Array]:
    """(azimuths (n,), offsets (k,) in pixels outward, values (n, k); NaN out of the photo)."""
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


def _by_consensus(picture: Array, camera: Camera, sphere: Sphere, search: float) -> list[Sphere]:
    radius = pixel_radius(sphere, camera)
    if not np.isfinite(radius):
        return []
    azimuths, offsets, values = _profiles(picture, camera, sphere, max(4.0, search * radius))
    inside = values[np.isfinite(values)]
    if inside.size == 0:
        return []
    # compressed, so that a highlight's edge is no stronger than an outline before a dark wall
    middle = np.median(inside)
    soft = values / (np.abs(values) + max(middle, 1e-3 * np.max(np.abs(inside)), 1e-30))
    slope = np.abs(ndimage.gaussian_filter1d(soft, 2.0, axis=1, order=1))
    slope = np.nan_to_num(slope)
    peak = (slope[:, 1:-1] >= slope[:, :-2]) & (slope[:, 1:-1] > slope[:, 2:])
    strength = np.where(peak, slope[:, 1:-1], 0.0)
    floor = STRONGER * np.median(slope, axis=1, keepdims=True)
    strength = np.where(strength > np.maximum(floor, 1e-4), strength, 0.0)
    order = np.argsort(-strength, axis=1)[:, :CANDIDATES]
    weight = np.take_along_axis(strength, order, axis=1)
    places = offsets[1 + order]
    having = np.nonzero(weight[:, 0] > 0)[0]
    if len(having) < LEAST_SUPPORT * PROFILES:
        return []
    limit = np.median(weight[having, 0])
    # a chrome sphere mirrors its table at the rim: a faint edge there is worth nearly a strong one
    worth = np.sqrt(np.minimum(weight / limit, 1.0))
    # votes: an outline moved by (x, y) and widened by w passes azimuth t at
    # x cos t + y sin t + w − (x sin t − y cos t)² / 2R: an edge there tells w for each (x, y)
    step = max(1.0, FINENESS * radius)
    reach = float(offsets[-1])
    shifts = np.arange(-reach, reach + step / 2, step)
    x, y = (axis.reshape(-1, 1, 1) for axis in np.meshgrid(shifts, shifts, indexing="ij"))
    cos, sin = np.cos(azimuths)[None, :, None], np.sin(azimuths)[None, :, None]
    wider = places[None] - (x * cos + y * sin) + (x * sin - y * cos) ** 2 / (2 * radius)
    column = np.round((wider + reach) / step).astype(int)
    bins = round(2 * reach / step) + 1
    usable = (column >= 0) & (column < bins) & (worth[None] > 0)
    place = np.arange(len(x))[:, None, None] * bins + column
    votes = np.bincount(
        place[usable], np.broadcast_to(worth[None], place.shape)[usable], len(x) * bins
    )
    score = ndimage.gaussian_filter(votes.reshape(len(shifts), len(shifts), bins), 0.7)
    widths = np.arange(bins) * step - reach
    # what the sphere mirrors has edges too, and they are inside
    score *= np.maximum(1 + OUTWARD * widths / radius, 0.1)
    found = []
    spaced = max(1, round(APART * radius / step))
    for _ in range(CONES):
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
    """(n, 2) pixels of the outline moved by (x, y) and widened, in radii, seen from its middle."""
    x, y, wider = shift
    cos, sin = np.cos(azimuths), np.sin(azimuths)
    scale = 1 + x * cos + y * sin + wider - (x * sin - y * cos) ** 2 / 2
    return sphere.outline(camera, azimuths, scale)


def _by_rim(
    picture: Array, camera: Camera, sphere: Sphere, unit: float = 1.0
) -> RefinedOutline | None:
    """All profiles at once: the cone on which the rim's shape leaves least of them unexplained.

    unit: pixels that count as one, 2 units or less from the outline.
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
    # the logarithm: an edge that is clear counts, how unclear the others are does not
    misfit = np.log(left + CLEAREST)
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
    best, worth = least.x, -float(least.fun) / PROFILES
    try:
        fit = fit_sphere(camera, sphere.outline(camera, turn, 1 + rows @ best / radius))
    except InputError:
        return None
    places = SHIFTS[np.argmin(left, axis=1)]
    miss = places - rows @ best
    on_it = (left.min(axis=1) < MOST_LEFT) & (np.abs(miss) < NEAR)
    hit = np.zeros(PROFILES, bool)
    hit[np.nonzero(good)[0][on_it]] = True
    if not _covers(hit):
        return None
    rms = float(np.sqrt(np.mean(miss[on_it] ** 2)))
    # neighbouring profiles share pixels: as many are independent as the outline has pixels
    fewer = max(1.0, PROFILES / (2 * np.pi * radius))
    spread = np.linalg.inv(rows[on_it].T @ rows[on_it]) * (rms**2 * fewer)
    return RefinedOutline(
        fit, float(hit.mean()), rms * unit, worth, np.sqrt(np.diag(spread) + BIAS**2) / radius
    )


def _covers(hit: NDArray[np.bool_]) -> bool:
    """Enough of the outline, and no half of it missing."""
    if hit.mean() < LEAST_SUPPORT:
        return False
    places = np.nonzero(hit)[0]
    gaps = np.diff(np.append(places, places[0] + len(hit)))
    return bool(gaps.max() * 2 * np.pi / len(hit) < WIDEST_GAP)
