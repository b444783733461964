"""One lit photo, its prediction, and the criterion that decided about each of its pixels."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..basis import PrincipalBRDF
from ..capture import Capture
from ..capture.model import HIGHLIGHT_MASK, IGNORE_MASK, SHADOW_MASK
from ..fit import PaperFit
from ..fit.held_out import DARK
from ..fit.measured_result import MeasuredResult
from ..fit.reliability import below_curvature_limit
from ..geometry import PixelRays, RayScene, SurfaceView, Window, bands, view_window
from ..inputs import capture_data
from ..inputs.lights import Lights
from ..inputs.material_pixels import material_pixels
from ..inputs.photos import LitPhoto, LitPhotos
from ..predict.compose import predict_photo
from ..samples import Criterion
from ..samples.take import deciding_criteria, halo, light_surface
from ..scan import Camera, Scan
from ..varying.node_model import NodeModel
from ..varying.varying_surface import VaryingSurface, predict_varying
from . import display
from .reduced_photo import (
    reduced_camera,
    reduced_margins,
    reduced_masks,
    reduced_photo,
    reduction,
)

MARGIN = 12  # pixels around the object
BAND_PIXELS = 1 << 15  # pixels of a band: a tenth of a second with its prediction
ROWS_AT_ONCE = 256  # rows of a photo that are summed at once, to save memory
MASK_CRITERIA = {
    SHADOW_MASK: Criterion.SHADOW_MASK,
    HIGHLIGHT_MASK: Criterion.HIGHLIGHT_MASK,
    IGNORE_MASK: Criterion.IGNORE_MASK,
}

Fitted = tuple[str, PrincipalBRDF, float]
"""(material, its BRDF, scale: the factor of the BRDF where the irradiance is unknown, else 1)."""


@dataclass(frozen=True)
class PhotoView:
    """One photo of a capture, cut to ``box`` (rows, columns of the whole photo): h × w pixels.

    measured: (h, w, 3) linear radiance; predicted: (h, w, 3), NaN where there is no BRDF, 0 in
    shadow; criteria: (h, w) uint8, the deciding Criterion of each pixel; material: (h, w) int16,
    index of the material in the capture, −1 for none (the last one where masks overlap); chosen:
    (k, 2) int, row and column in the box of the pixels that a fit uses, where they are known;
    white: the radiance shown as white; error: ‖predicted − measured‖ / ‖measured‖ where there is a
    prediction, including edges and shadows; counts: (criteria,) number of pixels of the surface
    for each criterion; factor: a pixel here is the mean of factor × factor pixels of the photo.
    """

    place: int
    name: str
    box: tuple[slice, slice]
    measured: NDArray[np.float32]
    predicted: NDArray[np.float32]
    criteria: NDArray[np.uint8]
    material: NDArray[np.int16]
    chosen: NDArray[np.intp]
    white: float
    error: float
    counts: NDArray[np.int64]
    factor: int = 1

    @property
    def surface(self) -> int:
        """Number of pixels that show the mesh."""
        return int(self.counts.sum())

    @property
    def typical(self) -> float:
        """Median relative error of the reliable pixels that are not dark, NaN without any. Defined
        as the error on held-out photos, but the fit has used this photo."""
        known = (self.criteria == Criterion.RELIABLE) & np.isfinite(self.predicted[..., 0])
        photo, ours = self.measured[known], self.predicted[known]
        level = photo.mean(axis=-1)
        if not len(level):
            return float("nan")
        bright = level > max(DARK * float(np.median(level)), 0.0)
        residual = np.abs(ours - photo).mean(axis=-1)
        return float(np.median(residual[bright] / level[bright])) if bright.any() else float("nan")

    @property
    def shares(self) -> dict[Criterion, float]:
        """Criterion → share 0 … 1 of the surface that it decided about; only those with any."""
        some = {c: int(self.counts[c]) for c in Criterion}
        return {c: count / self.surface for c, count in some.items() if count}


@dataclass(frozen=True)
class _Canvas:
    """The images that the bands of a photo are written into: a part of its rows and columns."""

    top: int
    left: int
    predicted: NDArray[np.float32]
    criteria: NDArray[np.uint8]
    material: NDArray[np.int16]

    @classmethod
    def around(cls, windows: Sequence[Window], camera: Camera) -> _Canvas:
        """A canvas that holds all bands and a margin; the whole photo without any bands."""
        top = left = 0
        bottom, right = camera.height, camera.width
        if windows:
            top = max(0, min(w.first for w in windows) - MARGIN)
            left = max(0, min(w.left for w in windows) - MARGIN)
            bottom = min(bottom, max(w.last for w in windows) + MARGIN)
            right = min(right, max(w.right for w in windows) + MARGIN)
        shape = bottom - top, right - left
        return cls(
            top,
            left,
            np.full((*shape, 3), np.nan, np.float32),
            np.full(shape, Criterion.NO_SURFACE, np.uint8),
            np.full(shape, -1, np.int16),
        )

    def places(self, view: SurfaceView, camera: Camera) -> NDArray[np.intp]:
        """Flat indices of the wanted pixels of a view."""
        row, column = np.divmod(view.pixel[view.wanted].astype(np.intp), camera.width)
        return (row - self.top) * self.criteria.shape[1] + column - self.left


def look_at_photo(
    capture: Capture,
    scan: Scan,
    rays: RayScene,
    photos: LitPhotos,
    lights: Lights,
    brdfs: Sequence[Fitted],
    place: int,
    used: NDArray[np.integer] | None = None,
    varying: VaryingSurface | None = None,
    side: int | None = None,
) -> Generator[float, None, PhotoView]:
    """Predict one photo and classify its pixels, band by band; yields the fraction done. Raises
    InputError for masks or photos that cannot be read.

    brdfs: of some or all materials of the capture, of any fit. used: (k,) flat indices in the
    photo of the pixels that a fit uses (see chosen_pixels). varying: how these materials vary over
    the surface, None if they are even. side: the photo is reduced for a picture of
    so many pixels (reduced_photo.py); None: it is not reduced.
    """
    full = capture_data.camera_of(capture, scan, place)
    factor = 1 if side is None else reduction(full, rays, side)
    camera = reduced_camera(full, factor)
    masks = reduced_masks(capture_data.photo_masks(capture, place), factor)
    light = lights.of(capture, place)
    yield 0.0
    photo = reduced_photo(photos.read(place), factor)
    lines = PixelRays.of(camera)
    margins, limit = reduced_margins(capture.fit.margins, factor), _curvature_limit(capture)
    index_of = {material.name: index for index, material in enumerate(capture.materials)}
    windows = list(bands(camera, halo(margins), rays.cover.columns(camera), BAND_PIXELS))
    canvas = _Canvas.around(windows, camera)
    known = [one for one in brdfs if one[0] in index_of]
    models = [NodeModel.of(brdf, scale) for _, brdf, scale in known if varying is not None]
    for done, window in enumerate(windows):
        yield (1 + done) / (2 + len(windows))
        view = view_window(rays, lines, window)
        lighting = light_surface(rays, view, light, camera)
        where, _ = material_pixels(capture, scan, view, masks)
        criteria = deciding_criteria(
            view,
            lighting,
            margins,
            list(where.values()),
            _excluded(masks, view),
            photo.usable.ravel().take(view.pixel),
            None if limit is None else below_curvature_limit(view.curvature, limit * factor),
        )
        material = np.full(len(view.pixel), -1, np.int16)
        for index, pixels in enumerate(where.values()):
            material[pixels] = index
        own = np.full_like(material, -1)
        own[view.wanted] = material[view.wanted]
        pixels_of = [own == index_of[name] for name, _, _ in known]
        if varying is None:
            parts = [(p, one[1], one[2]) for p, one in zip(pixels_of, known, strict=True)]
            predicted = predict_photo(view, lighting, parts)
        else:
            nodes = list(zip(pixels_of, models, strict=True))
            predicted = predict_varying(view, lighting, varying, nodes)
        target = canvas.places(view, camera)
        canvas.criteria.reshape(-1)[target] = criteria[view.wanted]
        canvas.material.reshape(-1)[target] = material[view.wanted]
        canvas.predicted.reshape(-1, 3)[target] = predicted[view.wanted]
    yield (1 + len(windows)) / (2 + len(windows))
    if used is not None:
        row, column = np.divmod(np.asarray(used, np.intp), full.width)
        row, column = row // factor, column // factor
        inside = (row < camera.height) & (column < camera.width)  # of those that are left out
        used = (row * camera.width + column)[inside]
    return _cropped(capture, camera, photo, canvas, place, used, factor)


def chosen_pixels(
    fits: Iterable[PaperFit | MeasuredResult], place: int
) -> NDArray[np.int32] | None:
    """(k,) flat indices in photo ``place`` of the pixels that the paper's method selected; None
    without fits by that method."""
    tables = [fit.chosen for fit in fits if isinstance(fit, PaperFit)]
    if not tables:
        return None
    return np.concatenate([table.pixel[table.photo == place] for table in tables])


def _curvature_limit(capture: Capture) -> float | None:
    """The largest curvature that the capture's method accepts, None for no limit."""
    return capture.fit.paper.curvature if capture.fit.method == "paper" else None


def _excluded(
    masks: Mapping[str, NDArray[np.bool_]], view: SurfaceView
) -> list[tuple[Criterion, NDArray[np.bool_]]]:
    """(criterion, (n,) True for excluded pixels) of each mask that excludes pixels."""
    return [
        (criterion, masks[name].ravel().take(view.pixel))
        for name, criterion in MASK_CRITERIA.items()
        if name in masks
    ]


def _cropped(
    capture: Capture,
    camera: Camera,
    photo: LitPhoto,
    canvas: _Canvas,
    place: int,
    used: NDArray[np.integer] | None,
    factor: int,
) -> PhotoView:
    """The PhotoView, cropped to the surface and a margin."""
    surface = canvas.criteria != Criterion.NO_SURFACE
    height, width = surface.shape
    rows, columns = display.crop_box(surface, MARGIN)
    inner = slice(*rows.indices(height)), slice(*columns.indices(width))
    box = (
        slice(inner[0].start + canvas.top, inner[0].stop + canvas.top),
        slice(inner[1].start + canvas.left, inner[1].stop + canvas.left),
    )
    measured, predicted = photo.radiance[box].copy(), canvas.predicted[inner]
    row, column = np.divmod(np.asarray([] if used is None else used, np.intp), camera.width)
    chosen = np.stack([row - box[0].start, column - box[1].start], axis=1)
    there = ((chosen >= 0) & (chosen < measured.shape[:2])).all(
        axis=1
    )  # those of another mesh may lie outside
    return PhotoView(
        place=place,
        name=capture.photo_name(place),
        box=box,
        measured=measured,
        predicted=predicted,
        criteria=canvas.criteria[inner],
        material=canvas.material[inner],
        chosen=chosen[there],
        white=display.white_level(measured[surface[inner]]),
        error=relative_error(predicted, measured),
        counts=np.bincount(canvas.criteria[surface], minlength=len(Criterion)),
        factor=factor,
    )


def relative_error(predicted: NDArray[np.floating], measured: NDArray[np.floating]) -> float:
    """‖predicted − measured‖ / ‖measured‖ of radiances (h, w, 3), over pixels with a prediction."""
    residual = size = 0.0
    for top in range(0, len(predicted), ROWS_AT_ONCE):
        ours, photo = predicted[top : top + ROWS_AT_ONCE], measured[top : top + ROWS_AT_ONCE]
        known = np.isfinite(ours[..., 0])
        residual += float(np.sum(np.square((ours - photo)[known], dtype=np.float64)))
        size += float(np.sum(np.square(photo[known], dtype=np.float64)))
    return (residual / max(size, 1e-300)) ** 0.5
