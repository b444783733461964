"""From what a capture says of its lights to where they are: spheres, sun, white targets."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..basis import Basis
from ..calibrate.refine import Refined, refine_lights
from ..calibrate.seen import Seen, draw_pixels
from ..capture import Capture, ChartEntry, LightEntry, SphereEntry, SunEntry, WhiteEntry
from ..errors import InputError, PatinaError
from ..geometry import RayScene, view_surface
from ..light import DistantLight, Light, MountedLight, NearLight
from ..light.sphere import light_from_sphere
from ..light.sphere_outline import Circle
from ..light.sun import sun_direction, sun_in_scan
from ..light.sun_time import photo_place, photo_time
from ..light.white import irradiance_from_white
from ..photo import read_mask
from ..photo.image import attributes
from ..scan import Camera, Scan
from ..scan.scan import find_camera
from . import capture_data
from .photos import LitPhotos

Array = NDArray[np.float64]

SUN_RADIUS = np.radians(0.2666)  # mean angular radius
LEAST_COSINE = 0.1  # of a chart with its light
WORST_SPHERE = 3.0  # degrees of standard error that are no direction any more
LONGEST_SUN = 120.0  # seconds that photos under one sun may be apart: half a degree
MOST_CLIPPED = 0.02  # of a white target's pixels
PIXELS = 1000  # of each photo, for refining


@dataclass(frozen=True)
class Lights:
    """by_name: every light of the capture. moved: of the refined ones, number → (value, standard
    error). unexplained: median |log residual| (before, after) refining. notes: sentences."""

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
    """Every light where its entry says it is; those to be refined are where the search will start.
    Raises InputError naming the capture's key."""
    found: dict[str, Light] = {}
    notes: list[str] = []
    for place, entry in enumerate(capture.lights):
        found[entry.name] = _light(capture, scan, photos, place, entry, notes)
    return Lights(found, tuple(notes))


def refined(
    lights: Lights, capture: Capture, scan: Scan, photos: LitPhotos, rays: RayScene, basis: Basis
) -> Generator[float, None, Lights]:
    """The lights marked ``refine`` moved to where the materials explain all photos best. Yields the
    fraction done; raises InputError where the photos show too little."""
    free = [entry.name for entry in capture.lights if entry.refine]
    rng = np.random.default_rng(0)
    seen: list[tuple[str, Seen]] = []
    for place, photo in enumerate(capture.photos):
        yield 0.3 * place / len(capture.photos)
        lit = photos.read(place)
        camera = capture_data.camera_of(capture, scan, place)
        material = _materials(capture, scan, rays, camera, place)
        material[~lit.usable] = -1
        seen.append((photo.light, draw_pixels(rays, camera, lit.radiance, material, PIXELS, rng)))
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
        f"light {entry.name!r}: its white target was read with the direction before refining"
        for entry in capture.lights
        if entry.refine and entry.white is not None and entry.white.normal is not None
    ]
    return replace(
        lights, by_name=found.lights, moved=found.moved,
        unexplained=(found.before, found.after), notes=tuple(notes),
    )  # fmt: skip


def _materials(
    capture: Capture, scan: Scan, rays: RayScene, camera: Camera, place: int
) -> NDArray[np.int16]:
    """(h, w) place of each pixel's material, −1 in masked shadow and where there is none."""
    shape = camera.height, camera.width
    only = capture.materials[0]
    whole = not (only.by_mesh or capture.named_by_masks(only.name) or capture.photos[place].masks)
    if whole and len(capture.materials) == 1:
        return np.zeros(shape, np.int16)
    view = view_surface(rays, camera)
    where, shadow = capture_data.material_pixels(capture, scan, view, place)
    found = np.full(shape[0] * shape[1], -1, np.int16)
    for index, material in enumerate(capture.materials):
        found[view.pixel[where[material.name] & ~shadow]] = index
    return found.reshape(shape)


def _light(
    capture: Capture,
    scan: Scan,
    photos: LitPhotos,
    place: int,
    entry: LightEntry,
    notes: list[str],
) -> Light:
    if entry.position is not None:
        return NearLight(entry.name, entry.position, entry.strength, entry.radius)
    if entry.mounted is not None:
        return MountedLight(entry.name, entry.mounted, entry.strength, entry.radius, entry.beam)
    radius = 0.0 if entry.angle is None else 0.5 * entry.angle
    key, mirrored = "direction", None
    try:
        if entry.sphere is not None:
            key = "sphere"
            direction, mirrored, said = _from_sphere(scan, photos, entry.sphere)
        elif entry.sun is not None:
            key = "sun"
            direction, said = _from_sun(capture, scan, entry)
            radius = SUN_RADIUS if entry.angle is None else radius
        else:
            assert entry.direction is not None  # the reader has made sure of one
            direction, said = entry.direction, []
        strength = entry.strength if mirrored is None else mirrored
        chart = capture.tone.chart
        if entry.charted and chart is not None:
            key = "direction"
            strength, more = _from_chart(photos, chart, direction)
            said = [*said, *more]
        if entry.white is not None:
            key = "white"
            strength, more = _from_white(photos, entry.white, direction)
            said = [*said, *more]
    except PatinaError as error:
        said_where = isinstance(error, InputError) and error.file is None
        message = error.said if said_where and isinstance(error, InputError) else str(error)
        raise capture.error(message, "light", place, key) from error
    notes += [f"light {entry.name!r}: {sentence}" for sentence in said]
    return DistantLight(entry.name, direction, strength, radius)


def _from_sphere(
    scan: Scan, photos: LitPhotos, entry: SphereEntry
) -> tuple[Array, Array | None, Sequence[str]]:
    """(direction, irradiance where the sphere's reflectance is known, notes)."""
    camera = find_camera(scan.cameras, entry.camera)
    if camera is None:
        raise InputError(
            f"the scan has no camera {entry.camera!r}: the photo of the sphere needs the viewpoint "
            "of a scan photo, or must be localised"
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
    if spread > WORST_SPHERE:
        raise InputError(
            f"the sphere gives the direction to ± {spread:.1f}° only: is all of it in the photo, "
            "is its outline right? Give center and radius, or a mask"
        )
    main = found.highlights[0]
    said = [
        f"direction from the sphere, ± {spread:.2f}°; its highlight at ({main.pixel[0]:.1f}, "
        f"{main.pixel[1]:.1f}) is {2 * np.degrees(main.angular_radius):.2f}° wide",
        *found.notes,
    ]
    if entry.reflectance is None:
        return found.direction, None, said
    mirrored = found.highlights[0].irradiance
    if mirrored is None:
        raise InputError(
            "the sphere's highlight is clipped: its photo gives the direction, not the irradiance; "
            "expose it less or leave reflectance out"
        )
    return found.direction, mirrored / entry.reflectance, said


def _from_chart(
    photos: LitPhotos, chart: ChartEntry, direction: Array
) -> tuple[Array, Sequence[str]]:
    """Decoded by its own curve, a patch shows its reflectance R: R = (R/π) E n·l, so E = π / n·l,
    in the unit that one exposure of the chart's photo makes."""
    cosine, said = 1.0, ["the chart is taken to face the light"]
    if chart.normal is not None:
        length = float(np.linalg.norm(chart.normal))
        cosine = float(chart.normal @ direction) / max(length, 1e-12)
        said = []
        if cosine < LEAST_COSINE:
            raise InputError("the chart's normal does not face the light that shines on it")
    return np.full(3, np.pi / cosine / photos.exposure_of(chart.photo)), said


def _from_sun(capture: Capture, scan: Scan, light: LightEntry) -> tuple[Array, Sequence[str]]:
    entry = light.sun or SunEntry()
    first = next((p for p in capture.photos if p.light == light.name), None)
    tags = attributes(first.file) if first is not None else {}
    said: list[str] = []
    time = entry.time
    if time is None:
        told = photo_time(tags)
        time = told.time
        _check_times(capture, light.name, time)
        said += [f"time {time.isoformat()} from the photo's {told.source}", *told.notes]
    geo = scan.georeference
    latitude, longitude, altitude = entry.latitude, entry.longitude, entry.altitude
    if latitude is None or longitude is None:
        if geo is not None:
            latitude, longitude = geo.latitude, geo.longitude
            altitude = geo.altitude if altitude is None else altitude
            said.append("place from the scan's georeference")
        else:
            here = photo_place(tags)
            latitude, longitude = here.latitude, here.longitude
            altitude = here.altitude if altitude is None else altitude
            said.append("place from the photo's GPS")
    north, up = entry.north, entry.up
    if north is None or up is None:
        if geo is None:
            raise InputError(
                "the scan does not know where north is: give north and up, in its frame",
                key="north",
            )
        north, up = geo.north, geo.up
    altitude = float(np.clip(altitude or 0.0, -500.0, 20_000.0))
    sun = sun_direction(latitude, longitude, time, altitude)
    said.append(
        f"the sun stood at azimuth {np.degrees(sun.azimuth) % 360:.2f}°, elevation "
        f"{np.degrees(sun.elevation):.2f}°"
    )
    return sun_in_scan(sun.enu, north, up), said


def _check_times(capture: Capture, light: str, first: datetime) -> None:
    """Refuse photos under one sun that were taken too long after one another."""
    for place, photo in enumerate(capture.photos):
        if photo.light != light:
            continue
        away = abs((photo_time(attributes(photo.file)).time - first).total_seconds())
        if away > LONGEST_SUN:
            raise InputError(
                f"{capture.photo_name(place)} was taken {away / 60:.0f} minutes from the light's "
                "first photo, and the sun moves a degree in four: give a [[light]] for each time"
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
            f"its mask is {mask.shape[1]} × {mask.shape[0]} pixels, its photo "
            f"{lit.usable.shape[1]} × {lit.usable.shape[0]}"
        )
    clipped = float((mask & ~lit.usable).sum()) / max(int(mask.sum()), 1)
    if clipped > MOST_CLIPPED:
        raise InputError(f"{100 * clipped:.0f} % of the white target is clipped: expose it less")
    normal = direction if entry.normal is None else entry.normal
    found = irradiance_from_white(
        lit.radiance, None, mask & lit.usable, entry.reflectance, normal, direction
    )
    numbers = ", ".join(
        f"{e:.4g} ± {s:.2g}" for e, s in zip(found.irradiance, found.standard_error, strict=True)
    )
    said = [f"irradiance from the white target: {numbers}", *found.notes]
    if entry.normal is None:
        said.append("the white target is taken to face the light")
    return found.irradiance, said
