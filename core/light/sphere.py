"""The direction of the light, from a photo of a mirror-like sphere."""

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
from .sphere_highlight import MOST, Blob, find_highlights
from .sphere_mirror import mirror, mirrored_at, solid_angle
from .sphere_outline import Circle, Sphere, circle_pixels, fit_sphere, mask_pixels, pixel_radius
from .sphere_search import search_sphere

Array = NDArray[np.float64]

RIM = 0.97  # of the outline's radius: beyond it the sphere mirrors what stands behind it
NEAR_RIM = 0.9  # a highlight beyond it is named in the notes
SECOND = 0.1  # of the main highlight's strength: a second one above it is named in the notes
COMPACT = 1.5  # pixels (RMS): a smaller highlight is the lens's blur, not the light's shape
DRAWN = 1.0  # pixels: how well a circle or mask is placed that was not refined
WELL_SEEN = 0.5  # of the outline
SMALLEST = 8.0  # pixels: radius of a sphere that still tells a direction
SAMPLES = 64  # of the grid on which the relative radius is computed, each way


@dataclass(frozen=True)
class Highlight:
    """One light as the sphere shows it.

    direction: (3,) unit, sphere → light, scan frame. pixel: (x, y) of the highlight. peak: (3,)
    radiance. irradiance: (3,) at normal incidence, times the sphere's own reflectance (chrome: 0.5
    to 0.7, the same for all photos of it); None where clipped or where the sphere is no mirror.
    angular_radius: radians, of the disc of as many steradians; it includes the lens's blur and the
    sphere's roughness. strength: relative to the main highlight's. clipped: as far as can be told.
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
    """What a photo of a sphere says about the light.

    direction: (3,) unit, surface → light, scan frame; of the main highlight. uncertainty: radians,
    one standard error, from the outline and the highlight's place. highlights: main one first.
    sphere: its outline as fitted. refined: whether the photo's edges placed it. notes: sentences
    for the user.
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
    """Direction of a distant light from the highlight on a chrome or glossy sphere.

    pixels: (h, w, 3) linear radiance of the photo of ``camera``. outline: a Circle near the
    sphere's (10 % off is near enough if refined), a mask (h, w) of it, or None: searched.
    surface: "glossy" for a dark dielectric ball, whose highlight is a lobe about the mirror
    direction. refine: place the outline by the photo's edges; by default yes for a circle, no for
    a mask. saturation: radiance from which a pixel is clipped; guessed from a plateau where None.

    The outline gives the cone of rays that touch the sphere, hence its centre in radii
    (sphere_outline.py). The ray d of the highlight meets it at a point with normal n, and mirrors
    to the light, d − 2(d·n)n. Raises InputError: sizes that differ, no outline, no highlight.
    """
    light = np.asarray(pixels)
    if light.shape != (camera.height, camera.width, 3):
        raise InputError(
            f"the sphere's photo is {light.shape[1]} × {light.shape[0]} pixels, its camera "
            f"{camera.width} × {camera.height}"
        )
    if not np.isfinite(light).all():
        raise InputError("the sphere's photo holds NaN or infinite values")
    notes: list[str] = []
    sphere, refined = _outline(light, camera, outline, refine, notes)
    radius = pixel_radius(sphere, camera)
    if not radius >= SMALLEST:
        raise InputError(
            f"the sphere's radius is {radius:.1f} pixels; expected {SMALLEST:g} or more"
        )
    sigma = refined.sigma if refined else np.full(3, DRAWN / radius)

    corner, inside = _inside(sphere, camera)
    part = light[corner[0] : corner[0] + inside.shape[0], corner[1] : corner[1] + inside.shape[1]]
    blobs = find_highlights(part, inside, saturation)
    if not blobs:
        raise InputError("no highlight on the sphere: nothing in it is brighter than its surface")
    found = sorted(
        (_highlight(blob, corner, part, sphere, camera, surface) for blob in blobs),
        key=lambda pair: (-int(pair[1].clipped), -pair[0]),
    )[:MOST]
    main = found[0][0]
    highlights = tuple(replace(h, strength=total / main) for total, h in found)
    first = highlights[0]
    uncertainty = _uncertainty(first, blobs, sphere, camera, sigma)
    notes += _notes(highlights, sphere, camera)
    return SphereLight(
        first.direction, uncertainty, highlights, sphere, refined is not None, tuple(notes)
    )


def relative_strengths(lights: Sequence[SphereLight]) -> Array | None:
    """(n, 3) irradiance of each photo's main light over the first's, from photos of one chrome
    sphere with one exposure (or divided by it); None where a highlight is clipped or the sphere was
    glossy: its reflectance changes with the angle."""
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
                "no sphere found in the photo; give its outline as a circle (center and radius in "
                "pixels) or as a mask"
            )
        return best.sphere, best
    if isinstance(outline, Circle):
        start = fit_sphere(camera, circle_pixels(outline))
    else:
        mask = np.asarray(outline)
        if mask.shape != light.shape[:2]:
            raise InputError(
                f"the sphere's mask is {mask.shape[1]} × {mask.shape[0]} pixels, its photo "
                f"{light.shape[1]} × {light.shape[0]}"
                if mask.ndim == 2
                else "the sphere's mask is no grey image"
            )
        start = _robust(camera, mask_pixels(mask))
    if refine is False or (refine is None and not isinstance(outline, Circle)):
        return start, None
    best = refine_outline(light, camera, start)
    if best is None:
        notes.append(
            "the sphere's edge does not stand out of its background: the outline is used as given"
        )
        return start, None
    if best.support < WELL_SEEN:
        notes.append(
            f"only {100 * best.support:.0f} % of the sphere's outline stands out of its "
            "background: check it, or draw a mask"
        )
    return best.sphere, best


def _robust(camera: Camera, points: Array) -> Sphere:
    """A mask may hold specks, a cut-off side or a stand: what is far from the fit is left out."""
    weights = np.ones(len(points))
    sphere = fit_sphere(camera, points)
    for _ in range(10):
        miss = sphere.relative_radius(camera, points) - 1
        spread = max(1.4826 * float(np.median(np.abs(miss))), 0.3 / pixel_radius(sphere, camera))
        weights = np.square(np.maximum(1 - np.square(miss / (4.685 * spread)), 0.0))
        if (weights > 0).sum() < 8:
            raise InputError("the edge of the sphere's mask is no outline of a sphere")
        sphere = fit_sphere(camera, points, weights)
    return sphere


def _inside(sphere: Sphere, camera: Camera) -> tuple[tuple[int, int], NDArray[np.bool_]]:
    """((row, column) of the top left, mask) of the box around the sphere's image."""
    ring = sphere.outline(camera, np.arange(180) / 180 * 2 * np.pi)
    if not np.isfinite(ring).all():
        raise InputError("the sphere is not wholly in front of its camera")
    low = np.maximum(np.floor(ring.min(axis=0)), 0.0).astype(int)
    high = np.minimum(np.ceil(ring.max(axis=0)), (camera.width, camera.height)).astype(int)
    if (high - low < 2).any():
        raise InputError("the sphere's outline lies outside its photo")
    # the relative radius is smooth: a lens with distortion is not asked for every pixel
    count = [int(min(size, SAMPLES)) for size in high - low]
    xs = np.linspace(low[0] + 0.5, high[0] - 0.5, count[0])
    ys = np.linspace(low[1] + 0.5, high[1] - 0.5, count[1])
    grid = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
    radius = sphere.relative_radius(camera, grid).reshape(count[1], count[0])
    width, height = high - low
    row = np.linspace(0, count[1] - 1, height)
    column = np.linspace(0, count[0] - 1, width)
    fine = ndimage.map_coordinates(radius, np.meshgrid(row, column, indexing="ij"), order=1)
    return (int(low[1]), int(low[0])), fine < RIM


def _highlight(
    blob: Blob,
    corner: tuple[int, int],
    part: NDArray,
    sphere: Sphere,
    camera: Camera,
    surface: str,
) -> tuple[float, Highlight]:
    """(its strength, the highlight)."""
    places = np.stack([blob.columns + corner[1] + 0.5, blob.rows + corner[0] + 0.5], axis=1)
    weights = blob.weights / blob.weights.sum()
    centre = weights @ places
    size = float(np.sqrt(weights @ ((places - centre) ** 2).sum(axis=1)))
    directions, normals = mirror(sphere, camera, places)
    half = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    corners, turned = mirror(sphere, camera, (places[:, None] + half).reshape(-1, 2))
    solid = solid_angle(corners.reshape(-1, 4, 3))
    if size < COMPACT:
        direction = mirror(sphere, camera, centre[None])[0][0]
    elif surface == "glossy":  # a lobe is symmetric about the half vector: mean over normals
        spread = weights * np.nan_to_num(solid_angle(turned.reshape(-1, 4, 3)))
        normal = spread @ np.nan_to_num(normals)
        direction = mirrored_at(normal / np.linalg.norm(normal), sphere, camera, centre)
    else:  # a light's shape is seen as it is: mean over directions
        direction = (weights * np.nan_to_num(solid)) @ np.nan_to_num(directions)
    direction = direction / np.linalg.norm(direction)
    radiance = part[blob.rows, blob.columns].astype(float)
    above = np.maximum(radiance - blob.background, 0.0)
    energy = np.nan_to_num(solid) @ above
    height = float(blob.peak.mean() - blob.background.mean())
    solid = np.nan_to_num(solid)
    if blob.clipped:
        steradians = float(solid[above.mean(axis=1) > 0.5 * height].sum())
    else:  # of a disc as bright as the peak that gives as much light
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
    """Standard error of the direction, radians: outline (three parameters) and highlight (two)."""
    at = np.array([highlight.pixel])
    base = mirror(sphere, camera, at)[0][0]
    sizes = [np.sqrt(len(b.rows) / np.pi) for b in blobs if np.allclose(b.peak, highlight.peak)]
    place = np.hypot(0.05, 0.05 * max(sizes, default=1.0))  # pixels
    total = 0.0
    for which in range(3):
        shift = [0.0, 0.0, 0.0]
        shift[which] = float(sigma[which])
        moved = sphere.moved(camera, (shift[0], shift[1], shift[2]))
        total += _turn(base, mirror(moved, camera, at)[0][0]) ** 2
    for step in ((place, 0.0), (0.0, place)):
        total += _turn(base, mirror(sphere, camera, at + step)[0][0]) ** 2
    return float(np.sqrt(total))


def _turn(first: Array, second: Array) -> float:
    if not np.isfinite(second).all():
        return float(np.pi / 4)  # it leaves the sphere: nothing is known
    return float(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second))


def _notes(highlights: tuple[Highlight, ...], sphere: Sphere, camera: Camera) -> list[str]:
    main, notes = highlights[0], []
    others = [h for h in highlights[1:] if h.strength > SECOND or h.clipped]
    if others:
        second = max(others, key=lambda h: h.strength)
        x, y = second.pixel
        notes.append(
            f"{len(others) + 1} highlights on the sphere; the one at ({x:.0f}, {y:.0f}) has "
            f"{100 * second.strength:.0f} % of the main one's strength: more than one light, or a "
            "reflection of the room"
        )
    if main.clipped:
        notes.append("the highlight is clipped: its direction holds, its strength is not known")
    edge = float(sphere.relative_radius(camera, np.array([main.pixel]))[0])
    if edge > NEAR_RIM:
        notes.append(
            "the highlight is at the sphere's rim, where a pixel is several degrees: the light "
            "stands behind the sphere"
        )
    return notes
