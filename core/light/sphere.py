"""Measure the direction of a light from a photo of a mirror-like sphere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..errors import InputError
from ..scan.camera import Camera
from .sphere_edge import RefinedOutline, refine_outline
from .sphere_highlight import MAX_HIGHLIGHTS, Blob, find_highlights
from .sphere_mirror import mirror, mirrored_at, solid_angle
from .sphere_outline import Circle, Sphere, circle_pixels, fit_sphere, mask_pixels, pixel_radius
from .sphere_search import search_sphere

Array = NDArray[np.float64]

MAX_HIGHLIGHT_RADIUS = 0.97  # of the outline's: beyond it the sphere mirrors the scene behind it
NEAR_RIM = 0.9  # of the outline's radius: a highlight beyond it gives a note
SECOND_STRENGTH = 0.1  # of the main highlight's strength: a stronger second one gives a note
COMPACT_SIZE = 1.5  # pixels (RMS): a smaller highlight shows the lens blur, not the light's shape
OUTLINE_ERROR = 1.0  # pixels, standard error of a given outline that was not refined
MIN_OUTLINE_SHARE = 0.5  # of the outline found in the photo: less gives a note
MIN_RADIUS = 8.0  # pixels of a sphere that gives a direction
GRID = 64  # points per side of the grid on which the relative radius is computed


@dataclass(frozen=True)
class Highlight:
    """The mirror image of one light in the sphere.

    direction: (3,) unit, sphere → light, scan frame. pixel: (x, y) of the highlight. peak: (3,)
    radiance. irradiance: (3,) at normal incidence, times the reflectance of the sphere (chrome: 0.5
    to 0.7, the same for all photos of it); None where clipped or where the sphere is not chrome.
    angular_radius: radians, of a disc with the same solid angle; it includes the lens blur and the
    roughness of the sphere. strength: relative to the main highlight. clipped: whether the
    highlight is probably clipped.
    """

    direction: Array
    pixel: tuple[float, float]
    peak: Array
    irradiance: Array | None
    angular_radius: float
    strength: float
    clipped: bool


@dataclass(frozen=True)
class SphereLight:
    """The light measured from a photo of a sphere.

    direction: (3,) unit, surface → light, scan frame; of the main highlight. uncertainty: radians,
    one standard error, from the outline and the highlight's position. highlights: the main one
    first. sphere: the fitted sphere. refined: whether the outline was fitted to edges in the photo.
    notes: sentences for the user.
    """

    direction: Array
    uncertainty: float
    highlights: tuple[Highlight, ...]
    sphere: Sphere
    refined: bool
    notes: tuple[str, ...]


def light_from_sphere(
    pixels: NDArray,
    camera: Camera,
    outline: Circle | NDArray | None = None,
    *,
    surface: Literal["chrome", "glossy"] = "chrome",
    refine: bool | None = None,
    saturation: float | None = None,
) -> SphereLight:
    """Measure the direction of a distant light from the highlight on a chrome or glossy sphere.

    pixels: (h, w, 3) linear radiance of the photo of ``camera``. outline: a Circle near the
    sphere's outline (within 10 % if refined), a mask (h, w), or None to search for the sphere.
    surface: "glossy" for a dark dielectric ball, whose highlight is a lobe about the mirror
    direction. refine: fit the outline to edges in the photo; by default True for a circle, False
    for a mask. saturation: radiance from which a pixel is clipped; None: detected by a plateau.

    The outline gives the cone of rays tangent to the sphere, and so its centre in radii
    (sphere_outline.py). The highlight's ray d meets the sphere at a point with normal n; the
    direction to the light is its reflection d − 2(d·n)n. Raises InputError for different sizes of
    photo and camera, and where there is no outline or no highlight.
    """
    light = np.asarray(pixels)
    if light.shape != (camera.height, camera.width, 3):
        raise InputError(
            f"the sphere's photo is {light.shape[1]} × {light.shape[0]} pixels; expected "
            f"{camera.width} × {camera.height}, the size of its camera"
        )
    if not np.isfinite(light).all():
        raise InputError("the sphere's photo has NaN or infinite pixels; expected finite numbers")
    notes: list[str] = []
    sphere, refined = _outline(light, camera, outline, refine, notes)
    radius = pixel_radius(sphere, camera)
    if not radius >= MIN_RADIUS:
        raise InputError(
            f"the sphere's radius is {radius:.1f} pixels; expected {MIN_RADIUS:g} or more: take a "
            "closer photo"
        )
    sigma = refined.sigma if refined else np.full(3, OUTLINE_ERROR / radius)

    corner, inside = _inside(sphere, camera)
    part = light[corner[0] : corner[0] + inside.shape[0], corner[1] : corner[1] + inside.shape[1]]
    blobs = find_highlights(part, inside, saturation)
    if not blobs:
        raise InputError(
            "found no highlight on the sphere; expected a spot brighter than its surface: check "
            "the outline and the photo"
        )
    found = sorted(
        (_highlight(blob, corner, part, sphere, camera, surface) for blob in blobs),
        key=lambda pair: (-int(pair[1].clipped), -pair[0]),
    )[:MAX_HIGHLIGHTS]
    main = found[0][0]
    highlights = tuple(replace(h, strength=total / main) for total, h in found)
    first = highlights[0]
    uncertainty = _uncertainty(first, blobs, sphere, camera, sigma)
    notes += _notes(highlights, sphere, camera)
    return SphereLight(
        first.direction, uncertainty, highlights, sphere, refined is not None, tuple(notes)
    )


def relative_strengths(lights: Sequence[SphereLight]) -> Array | None:
    """(n, 3) irradiance of each photo's main light relative to the first photo's.

    lights: from photos of one chrome sphere with the same exposure (or divided by it). None where
    a highlight is clipped or the sphere is glossy, because its reflectance depends on the angle.
    """
    values = [light.highlights[0].irradiance for light in lights]
    if not values or any(v is None or not (v > 0).all() for v in values):
        return None
    known = np.array(values)
    return known / known[0]


def _outline(
    light: NDArray,
    camera: Camera,
    outline: Circle | NDArray | None,
    refine: bool | None,
    notes: list[str],
) -> tuple[Sphere, RefinedOutline | None]:
    if outline is None:
        best = search_sphere(light, camera)
        if best is None:
            raise InputError(
                "found no sphere in the photo; give its outline as a circle (center and radius in "
                "pixels) or as a mask"
            )
        return best.sphere, best
    if isinstance(outline, Circle):
        start = fit_sphere(camera, circle_pixels(outline))
    else:
        mask = np.asarray(outline)
        if mask.shape != light.shape[:2]:
            raise InputError(
                f"the sphere's mask is {mask.shape[1]} × {mask.shape[0]} pixels; expected "
                f"{light.shape[1]} × {light.shape[0]}, the size of its photo"
                if mask.ndim == 2
                else "the sphere's mask is not a grey image; expected one channel"
            )
        start = _robust(camera, mask_pixels(mask))
    if refine is False or (refine is None and not isinstance(outline, Circle)):
        return start, None
    best = refine_outline(light, camera, start)
    if best is None:
        notes.append(
            "the sphere's edge has too little contrast with the background, so the given outline "
            "is used without refinement."
        )
        return start, None
    if best.support < MIN_OUTLINE_SHARE:
        notes.append(
            f"only {100 * best.support:.0f} % of the sphere's outline has enough contrast with the "
            "background. Check the outline, or draw a mask."
        )
    return best.sphere, best


def _robust(camera: Camera, points: Array) -> Sphere:
    """Robust fit (Tukey's biweight) to points of a mask's edge, which may include specks, a cut-off
    side or the sphere's stand."""
    weights = np.ones(len(points))
    sphere = fit_sphere(camera, points)
    for _ in range(10):
        miss = sphere.relative_radius(camera, points) - 1
        spread = max(1.4826 * float(np.median(np.abs(miss))), 0.3 / pixel_radius(sphere, camera))
        weights = np.square(np.maximum(1 - np.square(miss / (4.685 * spread)), 0.0))
        if (weights > 0).sum() < 8:
            raise InputError(
                "the edge of the sphere's mask is not the outline of a sphere; expected a white "
                "disc on black"
            )
        sphere = fit_sphere(camera, points, weights)
    return sphere


def _inside(sphere: Sphere, camera: Camera) -> tuple[tuple[int, int], NDArray[np.bool_]]:
    """((row, column) of the top left corner, mask) of the bounding box of the sphere's image."""
    ring = sphere.outline(camera, np.arange(180) / 180 * 2 * np.pi)
    if not np.isfinite(ring).all():
        raise InputError(
            "part of the sphere is behind its camera; expected all of it in front: check camera "
            "and outline"
        )
    low = np.maximum(np.floor(ring.min(axis=0)), 0.0).astype(int)
    high = np.minimum(np.ceil(ring.max(axis=0)), (camera.width, camera.height)).astype(int)
    if (high - low < 2).any():
        raise InputError(
            "the sphere's outline lies outside its photo; expected it inside: check center and "
            "radius"
        )
    # the relative radius is smooth, so it is interpolated: undistorting every pixel is slow
    count = [int(min(size, GRID)) for size in high - low]
    xs = np.linspace(low[0] + 0.5, high[0] - 0.5, count[0])
    ys = np.linspace(low[1] + 0.5, high[1] - 0.5, count[1])
    grid = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
    radius = sphere.relative_radius(camera, grid).reshape(count[1], count[0])
    width, height = high - low
    row = np.linspace(0, count[1] - 1, height)
    column = np.linspace(0, count[0] - 1, width)
    fine = ndimage.map_coordinates(radius, np.meshgrid(row, column, indexing="ij"), order=1)
    return (int(low[1]), int(low[0])), fine < MAX_HIGHLIGHT_RADIUS


def _highlight(
    blob: Blob,
    corner: tuple[int, int],
    part: NDArray,
    sphere: Sphere,
    camera: Camera,
    surface: str,
) -> tuple[float, Highlight]:
    """(strength of the highlight, its Highlight)."""
    places = np.stack([blob.columns + corner[1] + 0.5, blob.rows + corner[0] + 0.5], axis=1)
    weights = blob.weights / blob.weights.sum()
    centre = weights @ places
    size = float(np.sqrt(weights @ ((places - centre) ** 2).sum(axis=1)))
    directions, normals = mirror(sphere, camera, places)
    half = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    corners, turned = mirror(sphere, camera, (places[:, None] + half).reshape(-1, 2))
    solid = solid_angle(corners.reshape(-1, 4, 3))
    if size < COMPACT_SIZE:
        direction = mirror(sphere, camera, centre[None])[0][0]
    elif surface == "glossy":  # a lobe is symmetric about the half vector: average the normals
        spread = weights * np.nan_to_num(solid_angle(turned.reshape(-1, 4, 3)))
        normal = spread @ np.nan_to_num(normals)
        direction = mirrored_at(normal / np.linalg.norm(normal), sphere, camera, centre)
    else:  # a mirror shows the light's shape: average the directions
        direction = (weights * np.nan_to_num(solid)) @ np.nan_to_num(directions)
    direction = direction / np.linalg.norm(direction)
    radiance = part[blob.rows, blob.columns].astype(float)
    above = np.maximum(radiance - blob.background, 0.0)
    energy = np.nan_to_num(solid) @ above
    height = float(blob.peak.mean() - blob.background.mean())
    solid = np.nan_to_num(solid)
    if blob.clipped:
        steradians = float(solid[above.mean(axis=1) > 0.5 * height].sum())
    else:  # of a disc with the radiance of the peak and the same irradiance
        steradians = float(energy.mean()) / max(height, 1e-300)
    measured = surface == "chrome" and not blob.clipped
    highlight = Highlight(
        direction=direction,
        pixel=(float(centre[0]), float(centre[1])),
        peak=blob.peak,
        irradiance=energy if measured else None,
        angular_radius=float(np.arccos(max(1 - steradians / (2 * np.pi), -1.0))),
        strength=1.0,
        clipped=blob.clipped,
    )
    return max(float(energy.mean()), 1e-300), highlight


def _uncertainty(
    highlight: Highlight, blobs: list[Blob], sphere: Sphere, camera: Camera, sigma: Array
) -> float:
    """Standard error of the direction, radians, propagated from the outline (three parameters,
    ``sigma``) and the highlight's position (two)."""
    at = np.array([highlight.pixel])
    base = mirror(sphere, camera, at)[0][0]
    sizes = [np.sqrt(len(b.rows) / np.pi) for b in blobs if np.allclose(b.peak, highlight.peak)]
    place = np.hypot(0.05, 0.05 * max(sizes, default=1.0))  # pixels
    total = 0.0
    for which in range(3):
        shift = [0.0, 0.0, 0.0]
        shift[which] = float(sigma[which])
        moved = sphere.moved(camera, (shift[0], shift[1], shift[2]))
        total += _angle(base, mirror(moved, camera, at)[0][0]) ** 2
    for step in ((place, 0.0), (0.0, place)):
        total += _angle(base, mirror(sphere, camera, at + step)[0][0]) ** 2
    return float(np.sqrt(total))


def _angle(first: Array, second: Array) -> float:
    """Angle between two unit vectors, radians."""
    if not np.isfinite(second).all():
        return float(np.pi / 4)  # outside the sphere: a large value, because nothing is known
    return float(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second))


def _notes(highlights: tuple[Highlight, ...], sphere: Sphere, camera: Camera) -> list[str]:
    main, notes = highlights[0], []
    others = [h for h in highlights[1:] if h.strength > SECOND_STRENGTH or h.clipped]
    if others:
        second = max(others, key=lambda h: h.strength)
        x, y = second.pixel
        notes.append(
            f"the sphere shows {len(others) + 1} highlights. The one at ({x:.0f}, {y:.0f}) has "
            f"{100 * second.strength:.0f} % of the main highlight's strength. It is a second light "
            "or a reflection of the room."
        )
    if main.clipped:
        notes.append("the highlight is clipped. Its direction is valid, its strength is unknown.")
    edge = float(sphere.relative_radius(camera, np.array([main.pixel]))[0])
    if edge > NEAR_RIM:
        notes.append(
            "the highlight is near the sphere's rim, where one pixel covers several degrees. The "
            "light is behind the sphere."
        )
    return notes
