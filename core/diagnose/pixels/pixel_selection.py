"""Choose the pixels of a diagnosis from every photo, a band of rows at a time.

Half of a photo's share is drawn evenly from everything that shows the object, shadows too; the
other half where causes betray themselves: beside the edges of shadows and about the highlight. The
choice looks at geometry alone, never at what a pixel shows, so it does not bias any fit; only where
the first fit misses light over a whole spot some more are chosen, since a shadow may be small.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter

from ...angles import half_difference
from ...angles.vectors import dot
from ...capture import Capture
from ...concurrency.ordered_map import ordered_map
from ...errors import FitError
from ...geometry import PixelRays, RayScene, SurfaceView, Window, bands, edges, view_window
from ...inputs import capture_data
from ...inputs.lights import Lights
from ...inputs.photos import LitPhoto, LitPhotos
from ...light import Light
from ...samples.reservoir import sample_hash
from ...samples.take import light_surface
from ...scan import Camera, Scan
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.partial_visibility import partial_visibility
from ..forward.pixels import Pixels
from .image_cells import cell_numbers, centred_coordinates
from .refined_pixels import grid_step, on_grid, pixels_near_unexplained_shadows

Array = NDArray[np.float32]

COUNT = 24_000  # pixels of all photos
AHEAD = 2  # photos in memory beside the one that is waited for
REACH = 8  # pixels from the edge of a shadow that are told apart
HIGHLIGHT = np.radians(15.0)  # θh
MORE = 0.2  # of a photo's share, at most, about dark spots
BLOCKS = 6  # parts of a photo along the longer side of what it shows of the object
BESIDE = 1.5  # pixels from the edge of a shadow that may be lit in part
OUTLINE = 2  # pixels beside it that belong to no surface surely
LEAST_COS_O = 0.15  # beyond 81° a pixel sees too much surface
VEIL = 0.2  # of the diagonal
STENCIL = np.array([-2, -1, 0, 1, 2])  # derivative of a Gaussian about these
WIDTH = 1.0  # pixels, of that Gaussian


def select_pixels(
    capture: Capture,
    scan: Scan,
    rays: RayScene,
    photos: LitPhotos,
    lights: Lights,
    brdfs: MaterialBRDFs,
    scale: Array,
    pool: ThreadPoolExecutor | None,
    count: int = COUNT,
) -> Generator[float, None, Pixels]:
    """Yields the fraction done. brdfs: of the first fit, scale: (m,) of its samples. pool: threads
    that look at photos side by side. Raises InputError for photos and masks that cannot be read,
    FitError where no photo shows a material."""
    each = max(200, count // max(len(capture.photos), 1))

    def of_photo(place: int) -> Pixels | None:
        return _of_photo(capture, scan, rays, photos, lights, brdfs, scale, place, each)

    found = []
    places = range(len(capture.photos))
    for place, part in enumerate(ordered_map(pool, of_photo, places, ahead=AHEAD)):
        found += [] if part is None else [part]
        yield (place + 1) / len(places)
    if not found:
        raise FitError("no photo shows a material, in light or in shadow: expected one that does")
    return Pixels.join(found)


def _of_photo(
    capture: Capture,
    scan: Scan,
    rays: RayScene,
    photos: LitPhotos,
    lights: Lights,
    brdfs: MaterialBRDFs,
    scale: Array,
    place: int,
    count: int,
) -> Pixels | None:
    """None where nothing of the object is in the photo."""
    camera = capture_data.camera_of(capture, scan, place)
    masks = capture_data.photo_masks(capture, place)
    photo = photos.read_with_noise(place)
    light = lights.of(capture, place)
    lines = PixelRays.of(camera)
    step = grid_step(camera.width, camera.height)
    parts, grid = [], []
    for window in bands(camera, REACH + OUTLINE, rays.cover.columns(camera)):
        part = _of_band(capture, scan, rays, light, place, lines, photo, masks, window)
        parts.append(_thinned(part, count))
        grid.append(part.select(on_grid(part.pixel, camera.width, step)))
    if not parts:
        return None
    chosen, dense = _thinned(Pixels.join(parts), count), Pixels.join(grid)
    all_over = replace(
        dense,
        observed=photo.radiance.reshape(-1, 3).take(dense.pixel, axis=0),
        irradiance=dense.irradiance / scale[dense.material, None],
    )
    rows = pixels_near_unexplained_shadows(all_over, brdfs, camera.width, step, int(MORE * count))
    more = rows[~np.isin(dense.pixel[rows], chosen.pixel)]
    chosen = Pixels.join([chosen, dense.select(more)])
    return _with_photo(_part_lit(chosen, rays, light, camera), photo)


def _of_band(
    capture: Capture,
    scan: Scan,
    rays: RayScene,
    light: Light,
    place: int,
    lines: PixelRays,
    photo: LitPhoto,
    masks: Mapping[str, NDArray[np.bool_]],
    window: Window,
) -> Pixels:
    """All of a band that shows a material and no outline; what the photo says comes later."""
    view = view_window(rays, lines, window)
    lighting = light_surface(rays, view, light, lines.camera)
    facing = lighting.cos_i > 0
    cast = facing & lighting.shadowed
    lit = view.image(~lighting.shadowed, fill=0)
    edge = edges.shadow_edge(lit, view.seen)
    far = np.minimum(distance_transform_edt(~edge), REACH) if edge.any() else np.full(
        view.shape, REACH
    )  # fmt: skip
    where, painted = capture_data.material_pixels(capture, scan, view, place, masks)
    material = np.full(len(view.pixel), -1, np.int16)
    for index, entry in enumerate(capture.materials):
        material[where[entry.name]] = index
    cos_o = dot(view.normal, view.view)
    wanted = np.zeros(len(view.pixel), bool)
    wanted[view.wanted] = True
    outline = view.at(edges.widen(view.silhouette, OUTLINE - 1))
    rows = np.flatnonzero(wanted & (material >= 0) & ~outline & (cos_o > LEAST_COS_O) & ~painted)
    incidence = lighting.incidence.select(rows)
    n, camera = len(rows), lines.camera
    pixel = view.pixel.take(rows)
    x, y = centred_coordinates(pixel, camera.width, camera.height)
    none = np.zeros((n, 3), np.float32)
    return Pixels(
        photo=np.full(n, place, np.int16),
        material=material[rows],
        pixel=pixel,
        x=x,
        y=y,
        point=view.point[rows],
        normal=np.asarray(view.normal[rows], np.float32),
        view=np.asarray(view.view[rows], np.float32),
        light=np.array(incidence.towards, np.float32),
        irradiance=np.array(incidence.irradiance, np.float32),
        visible=(~cast[rows]).astype(np.float32),
        edge=view.at(far.astype(np.float32))[rows],
        curvature=view.curvature[rows],
        observed=none,
        noise=none,
        slope=np.zeros((n, 2, 3), np.float32),
        veil=np.zeros((n, 2, 3), np.float32),
        turn=_steps(view, view.normal)[rows],
        step=_steps(view, view.point - rays.origin)[rows],
        usable=photo.usable.ravel().take(pixel),
        block=np.zeros(n, np.int32),
    )


def _thinned(pixels: Pixels, count: int) -> Pixels:
    """At most ``count``: half drawn from all, half from those beside shadows and in the highlight.
    What is drawn of a whole photo does not depend on its bands."""
    if len(pixels) <= count:
        return pixels
    number = sample_hash(pixels.photo, pixels.pixel)
    theta_h = half_difference(pixels.normal, pixels.light, pixels.view).theta_h
    telling = (pixels.edge < REACH) | ((theta_h < HIGHLIGHT) & (pixels.visible > 0))
    chosen = np.zeros(len(pixels), bool)
    rows = np.flatnonzero(telling)
    chosen[rows[np.argsort(number[rows])[: count // 2]]] = True
    chosen[np.argsort(number)[: count - int(chosen.sum())]] = True
    return pixels.select(chosen)


def _with_photo(pixels: Pixels, photo: LitPhoto) -> Pixels:
    """What the photo shows at the pixels, and which part of it they are in."""
    flat = photo.radiance.reshape(-1, 3)
    seen = flat.take(pixels.pixel, axis=0)
    assert photo.variance is not None
    variance = photo.variance.reshape(-1, 3).take(pixels.pixel, axis=0)
    return replace(
        pixels,
        observed=seen,
        noise=np.maximum(variance, np.float32(1e-20)),
        slope=photo_slopes(photo.radiance, pixels.pixel),
        veil=photo_veil(photo.radiance, pixels.pixel),
        block=cell_numbers(pixels.photo, pixels.x, pixels.y, BLOCKS),
    )


def _part_lit(pixels: Pixels, rays: RayScene, light: Light, camera: Camera) -> Pixels:
    """What is lit in part beside the edges of shadows."""
    rows = np.flatnonzero(pixels.edge < BESIDE)
    if not len(rows):
        return pixels
    some, visible = pixels.select(rows), pixels.visible.copy()
    incidence = light.incidence(some.point, camera)
    visible[rows] = partial_visibility(rays, some, some.light, incidence.distance)
    return replace(pixels, visible=visible)


def _steps(view: SurfaceView, values: NDArray[np.floating]) -> Array:
    """(n, 2, 3) what normals or points (n, 3) are more a pixel to the right and down; 0 at
    outlines."""
    image = view.image(np.asarray(values, np.float32))
    out = np.zeros((*image.shape[:2], 2, 3), np.float32)
    out[:, 1:-1, 0] = 0.5 * (image[:, 2:] - image[:, :-2])
    out[1:-1, :, 1] = 0.5 * (image[2:] - image[:-2])
    return np.nan_to_num(view.at(out.reshape(*out.shape[:2], 6))).reshape(-1, 2, 3)


def photo_slopes(radiance: Array, pixel: NDArray[np.int32]) -> Array:
    """(n, 2, 3) derivatives to the right and down, of a photo (h, w, 3) under a narrow Gaussian, at
    flat places (n,)."""
    height, width = radiance.shape[:2]
    flat = radiance.reshape(-1, 3)
    row, column = np.divmod(pixel, width)
    bell = np.exp(-0.5 * (STENCIL / WIDTH) ** 2)
    bell /= bell.sum()
    rise = STENCIL * bell
    rise /= np.sum(rise * STENCIL)
    out = np.zeros((len(pixel), 2, 3), np.float32)
    for i, down in enumerate(STENCIL):
        for j, right in enumerate(STENCIL):
            at = np.clip(row + down, 0, height - 1) * width + np.clip(column + right, 0, width - 1)
            value = flat.take(at, axis=0)
            out[:, 0] += np.float32(bell[i] * rise[j]) * value
            out[:, 1] += np.float32(rise[i] * bell[j]) * value
    return out


def photo_veil(radiance: Array, pixel: NDArray[np.int32]) -> Array:
    """(n, 2, 3) a photo (h, w, 3) blurred widely, at flat places (n,), and its mean."""
    height, width = radiance.shape[:2]
    step = max(1, max(height, width) // 128)
    small = np.stack([_shrunk(radiance[..., c], step) for c in range(3)], axis=-1)
    blur = VEIL * float(np.hypot(small.shape[0], small.shape[1]))
    small = np.stack(
        [gaussian_filter(small[..., c], blur, mode="constant") for c in range(3)], axis=-1
    )
    row, column = np.divmod(pixel, width)
    at = np.minimum(row // step, len(small) - 1), np.minimum(column // step, small.shape[1] - 1)
    even = np.broadcast_to(radiance.mean(axis=(0, 1)), (len(pixel), 3))
    return np.stack([small[at], even], axis=1).astype(np.float32)


def _shrunk(channel: Array, step: int) -> Array:
    """Means over squares of ``step`` pixels."""
    height, width = (side // step * step for side in channel.shape)
    if step == 1:
        return channel
    cut = channel[:height, :width]
    return np.asarray(cut.reshape(height // step, step, width // step, step).mean(axis=(1, 3)))
