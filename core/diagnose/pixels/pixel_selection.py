"""Selection of the pixels of a diagnosis from every photo, a band of rows at a time.

Half of the pixels of a photo are drawn uniformly from the image of the object, shadows included.
The other half is drawn where causes have a large effect: near the edges of shadows and in the
highlight. The selection depends on geometry only, not on observed radiance, so it does not bias any
fit. The exception is a few more pixels around spots that are darker than the first fit predicts,
since a shadow may be small.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from ...angles import half_difference
from ...angles.vectors import dot
from ...capture import Capture
from ...concurrency.ordered_map import ordered_map
from ...errors import FitError
from ...geometry import PixelRays, RayScene, SurfaceView, Window, bands, edges, view_window
from ...inputs import capture_data
from ...inputs.lights import Lights
from ...inputs.material_pixels import material_pixels
from ...inputs.photos import LitPhoto, LitPhotos
from ...light import Light
from ...samples.reservoir import sample_hash
from ...samples.take import light_surface
from ...scan import Camera, Scan
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.partial_visibility import partial_visibility
from ..forward.pixels import Pixels
from .background import dark_background
from .image_cells import cell_numbers, centred_coordinates
from .neighbourhood import Veil, photo_slopes
from .refined_pixels import grid_step, on_grid, pixels_near_unexplained_shadows

Array = NDArray[np.float32]

COUNT = 24_000  # pixels of all photos
AHEAD = 2  # photos in memory in addition to the current one
REACH = 8  # pixels from the edge of a shadow up to which distances are computed
HIGHLIGHT = np.radians(15.0)  # θh within which a lit pixel counts as in the highlight
MAX_SPOT_FRACTION = 0.2  # of a photo's pixels that are added around dark spots
BLOCKS = 6  # held-out regions along the longer side of the image of the object
PENUMBRA = 1.5  # pixels from the edge of a shadow that may be partially lit
OUTLINE = 2  # pixels from an outline that may show another surface
MIN_COS_O = 0.15  # beyond 81° a pixel covers too much surface


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
    that process photos in parallel. count: pixels of all photos together, about. Raises InputError
    for photos and masks that cannot be read, FitError where no photo shows a material."""
    each = max(200, count // max(len(capture.photos), 1))

    def of_photo(place: int) -> Pixels | None:
        return _of_photo(capture, scan, rays, photos, lights, brdfs, scale, place, each)

    found = []
    places = range(len(capture.photos))
    for place, part in enumerate(ordered_map(pool, of_photo, places, ahead=AHEAD)):
        found += [] if part is None else [part]
        yield (place + 1) / len(places)
    if not found:
        raise FitError(
            "no photo shows a material, lit or in shadow; expected at least one that does"
        )
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
    """The selected pixels of one photo; None where the object is not in it."""
    camera = capture_data.camera_of(capture, scan, place)
    masks = capture_data.photo_masks(capture, place)
    photo = photos.read_with_noise(place)
    light = lights.of(capture, place)
    lines = PixelRays.of(camera)
    step = grid_step(camera.width, camera.height)
    parts, grid = [], []
    columns = rays.cover.columns(camera)
    for window in bands(camera, REACH + OUTLINE, columns):
        part = _of_band(capture, scan, rays, light, place, lines, photo, masks, window)
        parts.append(_thinned(part, count))
        grid.append(part.select(on_grid(part.pixel, camera.width, step)))
    if not parts:
        return None
    selected, dense = _thinned(Pixels.join(parts), count), Pixels.join(grid)
    all_over = replace(
        dense,
        observed=photo.radiance.reshape(-1, 3).take(dense.pixel, axis=0),
        irradiance=dense.irradiance / scale[dense.material, None],
    )
    rows = pixels_near_unexplained_shadows(
        all_over, brdfs, camera.width, step, int(MAX_SPOT_FRACTION * count)
    )
    more = rows[~np.isin(dense.pixel[rows], selected.pixel)]
    selected = Pixels.join([selected, dense.select(more)])
    return _with_photo(_with_partial_visibility(selected, rays, light, camera), photo, columns)


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
    """All pixels of a band that show a material and are not near an outline. The fields that need
    the photo are filled in later (_with_photo)."""
    view = view_window(rays, lines, window)
    lighting = light_surface(rays, view, light, lines.camera)
    facing = lighting.cos_i > 0
    cast = facing & lighting.shadowed
    lit = view.image(~lighting.shadowed, fill=0)
    edge = edges.shadow_edge(lit, view.seen)
    far = np.minimum(distance_transform_edt(~edge), REACH) if edge.any() else np.full(
        view.shape, REACH
    )  # fmt: skip
    where, painted = material_pixels(capture, scan, view, masks)
    material = np.full(len(view.pixel), -1, np.int16)
    for index, entry in enumerate(capture.materials):
        material[where[entry.name]] = index
    cos_o = dot(view.normal, view.view)
    wanted = np.zeros(len(view.pixel), bool)
    wanted[view.wanted] = True
    outline = view.at(edges.widen(view.silhouette, OUTLINE - 1))
    rows = np.flatnonzero(wanted & (material >= 0) & ~outline & (cos_o > MIN_COS_O) & ~painted)
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
        background=np.zeros((n, 3, 3), np.float32),
        turn=_steps(view, view.normal)[rows],
        step=_steps(view, view.point - rays.origin)[rows],
        usable=photo.usable.ravel().take(pixel),
        block=np.zeros(n, np.int32),
    )


def _thinned(pixels: Pixels, count: int) -> Pixels:
    """At most ``count`` pixels: half drawn from all, half from those near shadow edges or in the
    highlight. The selection does not depend on how a photo is divided into bands."""
    if len(pixels) <= count:
        return pixels
    number = sample_hash(pixels.photo, pixels.pixel)
    theta_h = half_difference(pixels.normal, pixels.light, pixels.view).theta_h
    informative = (pixels.edge < REACH) | ((theta_h < HIGHLIGHT) & (pixels.visible > 0))
    selected = np.zeros(len(pixels), bool)
    rows = np.flatnonzero(informative)
    selected[rows[np.argsort(number[rows])[: count // 2]]] = True
    selected[np.argsort(number)[: count - int(selected.sum())]] = True
    return pixels.select(selected)


def _with_photo(pixels: Pixels, photo: LitPhoto, columns: NDArray[np.integer]) -> Pixels:
    """The pixels with observed radiance, noise, gradient, veil and background of the photo, and
    with the numbers of their held-out regions. columns: that may show the mesh, as of Cover."""
    flat = photo.radiance.reshape(-1, 3)
    seen = flat.take(pixels.pixel, axis=0)
    assert photo.noise is not None
    variance = photo.noise.at(pixels.pixel, seen)
    veil = Veil.of(photo.radiance)
    background = dark_background(photo.radiance, columns, veil)
    return replace(
        pixels,
        observed=seen,
        noise=np.maximum(variance, np.float32(1e-20)),
        slope=photo_slopes(photo.radiance, pixels.pixel),
        veil=veil.at(*np.divmod(pixels.pixel, photo.radiance.shape[1])),
        background=np.tile(background, (len(pixels), 1, 1)),
        block=cell_numbers(pixels.photo, pixels.x, pixels.y, BLOCKS),
    )


def _with_partial_visibility(
    pixels: Pixels, rays: RayScene, light: Light, camera: Camera
) -> Pixels:
    """The pixels with partial visibility near the edges of shadows."""
    rows = np.flatnonzero(pixels.edge < PENUMBRA)
    if not len(rows):
        return pixels
    some, visible = pixels.select(rows), pixels.visible.copy()
    incidence = light.incidence(some.point, camera)
    visible[rows] = partial_visibility(rays, some, some.light, incidence.distance)
    return replace(pixels, visible=visible)


def _steps(view: SurfaceView, values: NDArray[np.floating]) -> Array:
    """(n, 2, 3) change of normals or points (n, 3) per pixel to the right and down; 0 at
    outlines."""
    image = view.image(np.asarray(values, np.float32))
    out = np.zeros((*image.shape[:2], 2, 3), np.float32)
    out[:, 1:-1, 0] = 0.5 * (image[:, 2:] - image[:, :-2])
    out[1:-1, :, 1] = 0.5 * (image[2:] - image[:-2])
    return np.nan_to_num(view.at(out.reshape(*out.shape[:2], 6))).reshape(-1, 2, 3)
