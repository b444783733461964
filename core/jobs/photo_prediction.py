"""Predict the photos of a capture from a fit, including photos that it was not fitted to."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..capture.model import IGNORE_MASK
from ..geometry import PixelRays, SurfaceView, bands, edges, view_window
from ..inputs import capture_data
from ..inputs.lights import Lights, find_lights
from ..inputs.photos import LitPhotos
from ..light import DistantLight, Light, MountedLight, NearLight
from ..photo.encoding import Encoding
from ..predict.compose import predict_photo
from ..predict.errors import PhotoErrors
from ..samples.take import halo, light_surface
from ..varying.varying_surface import predict_varying
from .fit_job import CaptureResult
from .fitted_scene import FittedScene

BAND_PIXELS = 1 << 17  # of a photo at a time: some tens of MB


@dataclass(frozen=True)
class PhotoPrediction:
    """The prediction of one photo of h × w pixels.

    place: index of the photo in its capture, from 0; name: its file. radiance: (h, w, 3)
    predicted linear radiance in the unit of the fitted photos (pixel value / exposure), 0 in
    shadow, NaN where no surface is seen. encoded: (h, w, 3) the same in the photo's own encoding;
    measured: (h, w, 3) the photo in that encoding; both with Rec.709 primaries, 0..1 for integer
    formats. compared: (h, w) pixels that ``errors`` are computed from: they see the mesh, are not
    near an outline and not in the mask "ignore". bounded: True for integer formats.
    """

    place: int
    name: str
    radiance: NDArray[np.float32]
    encoded: NDArray[np.float32]
    measured: NDArray[np.float32]
    compared: NDArray[np.bool_]
    errors: PhotoErrors
    bounded: bool


@dataclass(frozen=True)
class PredictionInputs:
    """Everything that the prediction of a capture's photos needs; see ``prediction_inputs``."""

    capture: Capture
    fitted: FittedScene
    photos: LitPhotos
    lights: Lights


def prediction_inputs(capture: Capture, fitted: CaptureResult) -> PredictionInputs:
    """Open a capture for prediction from a fit in memory; see ``inputs_from``."""
    return inputs_from(capture, FittedScene.of(fitted))


def inputs_from(capture: Capture, fitted: FittedScene) -> PredictionInputs:
    """Open a capture for prediction. Nothing is estimated from its photos.

    A light with the same entry as in the fitted capture is taken from the fit, with any refinement;
    other lights follow from their own entries. Raises InputError where the capture has another
    mesh, or where its lights or exposures are not in the unit of the fit.
    """
    if capture is fitted.capture:
        return PredictionInputs(capture, fitted, fitted.photos, fitted.lights)
    if not entries_equal(capture.scan, fitted.capture.scan):
        scan = capture_data.open_scan(capture)
        if not (
            np.array_equal(scan.mesh.faces, fitted.scan.mesh.faces)
            and np.array_equal(scan.mesh.vertices, fitted.scan.mesh.vertices)
        ):
            raise capture.error(
                "this is not the mesh of the fit; expected the same mesh, because the fitted "
                "materials are assigned to its faces",
                "scan", "mesh",
            )  # fmt: skip
        fitted = replace(fitted, scan=scan)
    capture_data.check_photos(capture, fitted.scan)
    photos, unit = _photos_in_unit_of(capture, fitted)
    return PredictionInputs(capture, fitted, photos, _lights(capture, fitted, photos, unit))


def predict_one(given: PredictionInputs, place: int) -> Generator[float, None, PhotoPrediction]:
    """Predict one photo, one band of rows at a time; yields the fraction done.

    place: index of the photo in ``given.capture``. Raises InputError.
    """
    capture, fitted = given.capture, given.fitted
    camera = capture_data.camera_of(capture, fitted.scan, place)
    light = given.lights.of(capture, place)
    shape = camera.height, camera.width
    radiance = np.full((shape[0] * shape[1], 3), np.nan, np.float32)
    inner = np.zeros(shape[0] * shape[1], bool)
    margins = fitted.capture.fit.margins
    lines = PixelRays.of(camera)
    columns = fitted.rays.cover.columns(camera)
    windows = list(bands(camera, halo(margins), columns, BAND_PIXELS))
    for done, window in enumerate(windows):
        yield done / (1 + len(windows))
        view = view_window(fitted.rays, lines, window)
        lighting = light_surface(fitted.rays, view, light, camera)
        material = fitted.face_material[view.face]
        pixels = [material == index for index in range(len(fitted.materials))]
        if fitted.varying is None:
            parts = [
                (own, found.brdf, found.scale)
                for own, found in zip(pixels, fitted.materials, strict=True)
            ]
            predicted = predict_photo(view, lighting, parts)
        else:
            predicted = predict_varying(
                view, lighting, fitted.varying, list(zip(pixels, fitted.node_models, strict=True))
            )
        wanted = view.pixel[view.wanted]
        radiance[wanted] = predicted[view.wanted]
        inner[wanted] = ~_near_outline(view, margins.silhouette)[view.wanted]
    yield len(windows) / (1 + len(windows))
    compared = inner & np.isfinite(radiance[:, 0])
    if IGNORE_MASK in capture.photos[place].masks:
        compared &= ~capture_data.photo_masks(capture, place)[IGNORE_MASK].ravel()
    photo = capture.photos[place]
    exposure = np.float32(given.photos.exposures[place][0])
    encoding = Encoding.of_file(photo.file, given.photos.curve(place))
    encoded = encoding.encode(radiance * exposure)
    measured = encoding.encode(given.photos.read(place).radiance * exposure)
    return PhotoPrediction(
        place=place,
        name=capture.photo_name(place),
        radiance=radiance.reshape(*shape, 3),
        encoded=encoded.reshape(*shape, 3),
        measured=measured,
        compared=compared.reshape(shape),
        errors=PhotoErrors.of(encoded[compared], measured.reshape(-1, 3)[compared]),
        bounded=encoding.bounded or not encoding.transfer.is_linear,
    )


def entries_equal(one: Any, other: Any) -> bool:
    """Whether two entries of capture files are equal, arrays included."""
    if is_dataclass(one) and not isinstance(one, type):
        return type(one) is type(other) and all(
            entries_equal(getattr(one, f.name), getattr(other, f.name)) for f in fields(one)
        )
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return one is not None and other is not None and np.array_equal(one, other)
    return bool(one == other)


def _near_outline(view: SurfaceView, margin: int) -> NDArray[np.bool_]:
    """(n,) pixels of a view within ``margin`` pixels of an outline."""
    if margin <= 0:
        return np.zeros(len(view.pixel), bool)
    return view.at(edges.widen(view.silhouette, margin - 1))


def _photos_in_unit_of(capture: Capture, fitted: FittedScene) -> tuple[LitPhotos, float]:
    """(the photos with exposures in the fit's unit, the factor from the capture's own unit of
    radiance to the fit's)."""
    own = LitPhotos.open(capture)
    first = fitted.photos.first
    if (own.first is None) != (first is None):
        raise capture.error(
            "the exposures of these photos and of the fitted photos are in different units: one "
            "capture takes them from EXIF, the other gives them in its file; give exposure in both",
            "photo", 0, "exposure",
        )  # fmt: skip
    if own.first is None or first is None or own.first == first:
        return own, 1.0
    ratio = own.first / first
    exposures = tuple(tuple(e * ratio for e in photo) for photo in own.exposures)
    return replace(own, exposures=exposures, first=first), 1.0 / ratio


def _lights(capture: Capture, fitted: FittedScene, photos: LitPhotos, unit: float) -> Lights:
    """The lights of the capture, with strengths in the fit's unit of radiance. unit: factor from
    the capture's unit to the fit's."""
    known: Sequence[Any] = fitted.capture.lights
    entries = {entry.name: entry for entry in known}
    shared = [e for e in capture.lights if e.name in entries and entries_equal(e, entries[e.name])]
    found = {entry.name: fitted.lights.by_name[entry.name] for entry in shared}
    others = tuple(entry for entry in capture.lights if entry.name not in found)
    if others:
        more = find_lights(replace(capture, lights=others), fitted.scan, photos)
        for entry in others:
            light = more.by_name[entry.name]
            if not (light.known and fitted.lights.known):
                raise capture.error(
                    f"the light {entry.name!r} is not in the fitted capture, and its strength "
                    "relative to the fitted lights is unknown; give irradiance or intensity in "
                    "both captures",
                    "light", capture.lights.index(entry), "name",
                )  # fmt: skip
            found[entry.name] = light if entry.strength is None else _scaled(light, unit)
    return Lights(found)


def _scaled(light: Light, factor: float) -> Light:
    """The light with its strength multiplied by ``factor``."""
    if isinstance(light, DistantLight):
        return replace(light, irradiance=light.effective_irradiance * factor)
    if isinstance(light, (NearLight, MountedLight)) and light.intensity is not None:
        return replace(light, intensity=light.intensity * factor)
    return light
