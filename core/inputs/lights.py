"""Compute the lights of a capture from its entries: spheres, sun, white targets, charts."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..basis import Basis
from ..calibrate.refine import Refined, refine_lights
from ..calibrate.seen import CalibrationPixels, draw_pixels
from ..capture import Capture, ChartEntry, LightEntry, SphereEntry, SunEntry, WhiteEntry
from ..errors import InputError, PatinaError
from ..geometry import RayScene
from ..light import DistantLight, Light, MountedLight, NearLight
from ..light.sphere import light_from_sphere
from ..light.sphere_outline import Circle
from ..light.sun import sun_direction, sun_in_scan
from ..light.sun_time import photo_place, photo_time
from ..light.white import irradiance_from_white
from ..photo import read_mask
from ..photo.image import attributes
from ..scan import Scan
from ..scan.scan import find_camera
from . import capture_data
from .material_image import material_image
from .photos import LitPhotos

Array = NDArray[np.float64]

SUN_RADIUS = np.radians(0.2666)  # mean angular radius
MIN_CHART_COSINE = 0.1  # between a chart's normal and its light
MAX_SPHERE_ERROR = 3.0  # degrees, standard error of a direction
MAX_SUN_TIME = 120.0  # seconds between photos with one sun entry: half a degree
MAX_CLIPPED_SHARE = 0.02  # of a white target's pixels
NEAR_SHARE = 0.05  # of the faces, that may be within the radius of a lamp
REFINE_PIXELS = 1000  # per photo


@dataclass(frozen=True)
class Lights:
    """The lights of a capture. by_name: every light. moved: for the refined ones, {parameter:
    (value, standard error)}. unexplained: median |log residual| (before, after) refining. notes:
    sentences."""

    by_name: dict[str, Light]
    notes: tuple[str, ...] = ()
    moved: dict[str, dict[str, tuple[float, float]]] = field(default_factory=dict)
    unexplained: tuple[float, float] | None = None

    def of(self, capture: Capture, place: int) -> Light:
        """The light of a photo."""
        return self.by_name[capture.photos[place].light]

    @property
    def known(self) -> bool:
        """True where reflectance has a scale."""
        return all(light.known for light in self.by_name.values())


def find_lights(capture: Capture, scan: Scan, photos: LitPhotos) -> Lights:
    """Compute every light from its entry; a light to be refined gets its start value.

    Raises InputError naming the capture's key.
    """
    found: dict[str, Light] = {}
    notes: list[str] = []
    for place, entry in enumerate(capture.lights):
        found[entry.name] = _light(capture, scan, photos, place, entry, notes)
    return Lights(found, tuple(notes))


def refined(
    lights: Lights, capture: Capture, scan: Scan, photos: LitPhotos, rays: RayScene, basis: Basis
) -> Generator[float, None, Lights]:
    """Optimise the lights marked ``refine`` so that the materials explain all photos best.

    Yields the fraction done. Raises InputError where the photos show too little.
    """
    free = [entry.name for entry in capture.lights if entry.refine]
    rng = np.random.default_rng(0)
    seen: list[tuple[str, CalibrationPixels]] = []
    for place, photo in enumerate(capture.photos):
        yield 0.3 * place / len(capture.photos)
        lit = photos.read(place)
        camera = capture_data.camera_of(capture, scan, place)
        material = material_image(capture, scan, rays, camera, place)
        material[~lit.usable] = -1
        seen.append(
            (photo.light, draw_pixels(rays, camera, lit.radiance, material, REFINE_PIXELS, rng))
        )
    steps = refine_lights(lights.by_name, free, seen, rays, basis)
    try:
        while True:
            try:
                yield 0.3 + 0.7 * next(steps)
            except StopIteration as end:
                found: Refined = end.value
                break
    except PatinaError as error:
        first = next(i for i, entry in enumerate(capture.lights) if entry.refine)
        raise capture.error(str(error), "light", first, "refine") from error
    notes = [*lights.notes, *found.notes]
    notes += [
        f"Light {entry.name!r}: the white target was evaluated with the direction before refining."
        for entry in capture.lights
        if entry.refine and entry.white is not None and entry.white.normal is not None
    ]
    return replace(
        lights, by_name=found.lights, moved=found.moved,
        unexplained=(found.before, found.after), notes=tuple(notes),
    )  # fmt: skip


def _check_radius(capture: Capture, scan: Scan, place: int, entry: LightEntry) -> None:
    """Raise InputError for a lamp that reaches into the object: beyond NEAR_SHARE of it, as a scan
    may show the lamp's stand."""
    if entry.position is None or entry.radius <= 0 or entry.guess:
        return
    used = scan.mesh.vertices[scan.mesh.faces[:, 0]]
    away = float(np.quantile(np.linalg.norm(used - entry.position, axis=1), NEAR_SHARE))
    if entry.radius >= away:
        raise capture.error(
            f"found a radius of {entry.radius:g}; the object is at a distance of {away:.3g} scan "
            "units from the lamp's centre: expected a smaller radius, in scan units",
            "light", place, "radius",
        )  # fmt: skip


def _light(
    capture: Capture,
    scan: Scan,
    photos: LitPhotos,
    place: int,
    entry: LightEntry,
    notes: list[str],
) -> Light:
    if entry.position is not None:
        _check_radius(capture, scan, place, entry)
        relative = entry.relative_strength or 1.0
        return NearLight(entry.name, entry.position, entry.strength, entry.radius, relative)
    if entry.mounted is not None:
        return MountedLight(entry.name, entry.mounted, entry.strength, entry.radius, entry.beam)
    radius = 0.0 if entry.angle is None else 0.5 * entry.angle
    key, mirrored = "direction", None
    try:
        if entry.sphere is not None:
            key = "sphere"
            direction, mirrored, found = _from_sphere(scan, photos, entry.sphere)
        elif entry.sun is not None:
            key = "sun"
            direction, found = _from_sun(capture, scan, entry)
            radius = SUN_RADIUS if entry.angle is None else radius
        else:
            assert entry.direction is not None  # the reader guarantees one of the three
            direction, found = entry.direction, []
        strength = entry.strength if mirrored is None else mirrored
        chart = capture.tone.chart
        if entry.charted and chart is not None:
            key = "direction"
            strength, more = _from_chart(photos, chart, direction)
            found = [*found, *more]
        if entry.white is not None:
            key = "white"
            strength, more = _from_white(photos, entry.white, direction)
            found = [*found, *more]
    except PatinaError as error:
        without_file = isinstance(error, InputError) and error.file is None
        message = error.detail if without_file and isinstance(error, InputError) else str(error)
        raise capture.error(message, "light", place, key) from error
    notes += [f"Light {entry.name!r}: {sentence}" for sentence in found]
    return DistantLight(entry.name, direction, strength, radius, entry.relative_strength or 1.0)


def _from_sphere(
    scan: Scan, photos: LitPhotos, entry: SphereEntry
) -> tuple[Array, Array | None, Sequence[str]]:
    """(direction, irradiance where the sphere's reflectance is known, notes)."""
    camera = find_camera(scan.cameras, entry.camera)
    if camera is None:
        raise InputError(
            f"the scan has no camera {entry.camera!r}; expected the camera of a scan photo with "
            "the viewpoint of the sphere's photo: name it, or localise the sphere's photo"
        )
    lit = photos.read_other(entry.photo)
    camera = camera.resized(lit.radiance.shape[1], lit.radiance.shape[0])
    outline: Circle | NDArray[np.bool_] | None = None
    if entry.mask is not None:
        outline = read_mask(entry.mask)
    elif entry.centre is not None and entry.radius is not None:
        outline = Circle((float(entry.centre[0]), float(entry.centre[1])), entry.radius)
    surface: Literal["chrome", "glossy"] = "glossy" if entry.surface == "glossy" else "chrome"
    found = light_from_sphere(lit.radiance, camera, outline, surface=surface)
    spread = float(np.degrees(found.uncertainty))
    if spread > MAX_SPHERE_ERROR:
        raise InputError(
            f"the direction from the sphere has an error of ± {spread:.1f}°; expected at most 3°: "
            "check that the photo shows the whole sphere, and give center and radius or a mask"
        )
    main = found.highlights[0]
    notes = [
        f"direction from the sphere, ± {spread:.2f}°. The highlight at ({main.pixel[0]:.1f}, "
        f"{main.pixel[1]:.1f}) is {2 * np.degrees(main.angular_radius):.2f}° wide.",
        *found.notes,
    ]
    if entry.reflectance is None:
        return found.direction, None, notes
    mirrored = found.highlights[0].irradiance
    if mirrored is None:
        raise InputError(
            "the sphere's highlight is clipped, so the photo gives the direction but not the "
            "irradiance; use a shorter exposure, or remove reflectance"
        )
    return found.direction, mirrored / entry.reflectance, notes


def _from_chart(
    photos: LitPhotos, chart: ChartEntry, direction: Array
) -> tuple[Array, Sequence[str]]:
    """(irradiance (3,), notes) from a colour chart.

    Decoded by the curve measured from the chart, the pixel value of a patch is its reflectance R:
    R = (R/π) E n·l. So E = π / n·l, in the unit of the chart photo's exposure.
    """
    cosine, notes = 1.0, ["the chart is assumed to face the light."]
    if chart.normal is not None:
        length = float(np.linalg.norm(chart.normal))
        cosine = float(chart.normal @ direction) / max(length, 1e-12)
        notes = []
        if cosine < MIN_CHART_COSINE:
            raise InputError(
                "the chart's normal does not face its light; expected less than 84° between them: "
                "check the normal's sign"
            )
    return np.full(3, np.pi / cosine / photos.exposure_of(chart.photo)), notes


def _from_sun(capture: Capture, scan: Scan, light: LightEntry) -> tuple[Array, Sequence[str]]:
    entry = light.sun or SunEntry()
    first = next((p for p in capture.photos if p.light == light.name), None)
    tags = attributes(first.file) if first is not None else {}
    notes: list[str] = []
    time = entry.time
    if time is None:
        taken = photo_time(tags)
        time = taken.time
        _check_times(capture, light.name, time)
        notes += [f"time {time.isoformat()} from the photo's {taken.source}.", *taken.notes]
    geo = scan.georeference
    latitude, longitude, altitude = entry.latitude, entry.longitude, entry.altitude
    if latitude is None or longitude is None:
        if geo is not None:
            latitude, longitude = geo.latitude, geo.longitude
            altitude = geo.altitude if altitude is None else altitude
            notes.append("location from the scan's georeference.")
        else:
            here = photo_place(tags)
            latitude, longitude = here.latitude, here.longitude
            altitude = here.altitude if altitude is None else altitude
            notes.append("location from the photo's GPS.")
    north, up = entry.north, entry.up
    if north is None or up is None:
        if geo is None:
            raise InputError(
                "the scan has no georeference, so north is unknown; give north and up in the "
                "scan's frame",
                key="north",
            )
        north, up = geo.north, geo.up
    altitude = float(np.clip(altitude or 0.0, -500.0, 20_000.0))
    sun = sun_direction(latitude, longitude, time, altitude)
    notes.append(
        f"sun at azimuth {np.degrees(sun.azimuth) % 360:.2f}°, elevation "
        f"{np.degrees(sun.elevation):.2f}°."
    )
    return sun_in_scan(sun.enu, north, up), notes


def _check_times(capture: Capture, light: str, first: datetime) -> None:
    """Raise InputError for photos of one sun entry that were taken too far apart in time."""
    for place, photo in enumerate(capture.photos):
        if photo.light != light:
            continue
        away = abs((photo_time(attributes(photo.file)).time - first).total_seconds())
        if away > MAX_SUN_TIME:
            raise InputError(
                f"{capture.photo_name(place)} was taken {away / 60:.0f} minutes before or after "
                "the light's first photo; expected at most 2 minutes, because the sun moves 1° in "
                "4 minutes: give a [[light]] for each time"
            )


def _from_white(
    photos: LitPhotos, entry: WhiteEntry, direction: Array
) -> tuple[Array, Sequence[str]]:
    if entry.exposure is None:
        photos.check_comparable(entry.photo)
    lit = photos.read_other(entry.photo, entry.exposure)
    mask = read_mask(entry.mask)
    if mask.shape != lit.usable.shape:
        raise InputError(
            f"the mask of the white target is {mask.shape[1]} × {mask.shape[0]} pixels; expected "
            f"{lit.usable.shape[1]} × {lit.usable.shape[0]}, the size of its photo"
        )
    clipped = float((mask & ~lit.usable).sum()) / max(int(mask.sum()), 1)
    if clipped > MAX_CLIPPED_SHARE:
        raise InputError(
            f"{100 * clipped:.0f} % of the white target's pixels are clipped; expected at most "
            "2 %: use a shorter exposure"
        )
    normal = direction if entry.normal is None else entry.normal
    found = irradiance_from_white(
        lit.radiance, None, mask & lit.usable, entry.reflectance, normal, direction
    )
    values = ", ".join(
        f"{e:.4g} ± {s:.2g}" for e, s in zip(found.irradiance, found.standard_error, strict=True)
    )
    notes = [f"irradiance from the white target: {values}.", *found.notes]
    if entry.normal is None:
        notes.append("the white target is assumed to face the light.")
    return found.irradiance, notes
