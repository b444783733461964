"""Find the unknown lights of a capture from its photos, as a job."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..basis import Basis, default_basis
from ..capture import Capture, LightEntry
from ..concurrency.job import Job, Step
from ..concurrency.steps import relayed, scaled
from ..counted import counted
from ..errors import PatinaError
from ..geometry import RayScene
from ..inputs import capture_data
from ..inputs.lights import Lights, find_lights
from ..inputs.material_image import material_image
from ..inputs.photos import LitPhotos
from ..light import DistantLight, MountedLight, NearLight
from ..light_search import FoundLamp, LampPhoto, UnknownLamp, draw_lamp_pixels, find_lamps
from ..light_search.brdf_dictionary import BrdfDictionary
from ..light_search.search import FINE_PIXELS
from ..scan import Scan

READING, SEARCHING = "reading photos", "searching lights"
READ_SHARE = 0.1  # of the job's time
MIN_PIXELS_OF_PHOTO = 150
MIN_STRENGTH_RATIO = 2.2  # of two lamps: lamps of equal strength are found to differ by up to 2.1,
# because the strength of a lamp behind the object is hard to tell from the reflectance there


@dataclass(frozen=True)
class FoundLights:
    """entries: all lights of the capture, those searched with their found values; lamps: by name,
    of those searched; notes: sentences about them."""

    entries: tuple[LightEntry, ...]
    lamps: dict[str, FoundLamp]
    notes: tuple[str, ...]


class FindLightsJob(Job):
    """Finds ``names`` of the capture's lights, without names all that are marked ``guess``. Sets
    ``result``. The other lights keep their values; their photos help to know the materials."""

    def __init__(
        self,
        capture: Capture,
        names: Collection[str] = (),
        basis: Basis | Callable[[], Basis] | None = None,
    ) -> None:
        """basis: as of FitJob. Raises PatinaError for a name that the capture does not have, and
        where there is nothing to find."""
        super().__init__()
        have = [entry.name for entry in capture.lights]
        unknown = [name for name in names if name not in have]
        if unknown:
            raise PatinaError(
                f"found no light {unknown[0]!r} in the capture; expected one of {', '.join(have)}"
            )
        self.names = frozenset(names or (e.name for e in capture.lights if e.guess))
        if not self.names:
            raise PatinaError(
                "no light of the capture is marked as a guess; name the lights to find, or set "
                "guess = true for them"
            )
        self.capture = capture
        self.basis = basis
        self.result: FoundLights | None = None

    def run(self) -> Iterator[Step]:
        """Read random pixels of every photo, then search."""
        yield Step(READING, 0.0)
        capture = self.capture
        scan = capture_data.open_scan(capture)
        photos = LitPhotos.open(capture)
        lights = find_lights(_without_locations(capture, self.names), scan, photos)
        rays = RayScene.build(scan.mesh)
        parts: dict[str, list[LampPhoto]] = {}
        rng = np.random.default_rng(0)
        for place, photo in enumerate(capture.photos):
            yield Step(READING, READ_SHARE * place / len(capture.photos))
            parts.setdefault(photo.light, []).append(
                _pixels(capture, scan, photos, rays, place, rng)
            )
        names = [name for name in lights.by_name if name in parts]
        lamps = [
            UnknownLamp(lights.by_name[name], tuple(parts[name]), name not in self.names)
            for name in names
        ]
        yield Step(SEARCHING, READ_SHARE)
        dictionary = BrdfDictionary.of(self._basis())
        steps = find_lamps(lamps, len(capture.materials), rays, dictionary)
        found = yield from relayed(
            scaled(steps, READ_SHARE, 1.0), lambda done: Step(SEARCHING, done)
        )
        by_name = {n: one for n, one in zip(names, found.lamps, strict=True) if one is not None}
        gains = dict(zip(names, found.gains, strict=True))
        strengths = _relative_strengths(capture, lights, gains)
        self.result = _result(capture, lights, by_name, parts, strengths)

    def _basis(self) -> Basis:
        if self.basis is None or isinstance(self.basis, Basis):
            return self.basis or default_basis()
        return self.basis()


def _without_locations(capture: Capture, names: Collection[str]) -> Capture:
    """The capture with placeholders in place of the spheres and suns of the lights to find."""
    entries = [
        replace(entry, direction=np.array([0.0, 0.0, 1.0]), sphere=None, sun=None, white=None)
        if entry.name in names and (entry.sphere is not None or entry.sun is not None)
        else entry
        for entry in capture.lights
    ]
    return replace(capture, lights=tuple(entries))


def _pixels(
    capture: Capture,
    scan: Scan,
    photos: LitPhotos,
    rays: RayScene,
    place: int,
    rng: np.random.Generator,
) -> LampPhoto:
    """Random pixels of one photo."""
    light = capture.photos[place].light
    siblings = sum(photo.light == light for photo in capture.photos)
    count = max(-(-FINE_PIXELS // siblings), MIN_PIXELS_OF_PHOTO)
    lit = photos.read(place)
    camera = capture_data.camera_of(capture, scan, place)
    material = material_image(capture, scan, rays, camera, place)
    material[~lit.usable] = -1
    return draw_lamp_pixels(rays, camera, lit.radiance, material, count, rng)


def _result(
    capture: Capture,
    lights: Lights,
    lamps: dict[str, FoundLamp],
    parts: dict[str, list[LampPhoto]],
    strengths: dict[str, float],
) -> FoundLights:
    entries, notes = [], list(lights.notes)
    for entry in capture.lights:
        lamp = lamps.get(entry.name)
        new = entry if lamp is None else _entry(entry, lamp)
        if entry.name in strengths:
            new = replace(new, relative_strength=strengths[entry.name])
        entries.append(new)
        if lamp is not None:
            notes.append(_sentence(entry.name, lamp, len(parts[entry.name])))
            if lamp.other is not None:
                angle = _angle_to(lamp)
                notes.append(
                    f"Light {entry.name!r}: a direction {angle:.0f}° away explains the photos "
                    "almost as well. Check the shadows in a photo, or add photos of this light "
                    "from other sides."
                )
    return FoundLights(tuple(entries), lamps, tuple(notes))


def _relative_strengths(
    capture: Capture, lights: Lights, gains: dict[str, float]
) -> dict[str, float]:
    """Strengths of the lights of unknown strength relative to one another, {} where all may be
    equal, where a strength is known, and for flashes.

    Only a light that differs from the median by more than MIN_STRENGTH_RATIO gets a value of its
    own; the others are 1.
    """
    total = {}
    for entry in capture.lights:
        light = lights.by_name[entry.name]
        if entry.strength_given or not isinstance(light, DistantLight | NearLight):
            return {}
        if entry.name in gains:
            total[entry.name] = gains[entry.name] * light.relative
    if len(total) < 2 or not min(total.values()) > 0:
        return {}
    unit = float(np.median(list(total.values())))
    ratios = {name: value / unit for name, value in total.items()}
    far = {n: r for n, r in ratios.items() if max(r, 1 / r) > MIN_STRENGTH_RATIO}
    return {name: far.get(name, 1.0) for name in ratios} if far else {}


def _angle_to(lamp: FoundLamp) -> float:
    assert isinstance(lamp.light, DistantLight) and lamp.other is not None
    return float(np.degrees(np.arccos(np.clip(lamp.light.direction @ lamp.other, -1.0, 1.0))))


def _entry(entry: LightEntry, lamp: FoundLamp) -> LightEntry:
    """The entry with the found values."""
    found = replace(entry, sphere=None, sun=None, guess=False, standard_error=lamp.standard_error)
    light = lamp.light
    if isinstance(light, DistantLight):
        return replace(found, direction=light.direction)
    if isinstance(light, MountedLight):
        return replace(found, mounted=light.offset, beam=light.beam)
    assert isinstance(light, NearLight)
    return replace(found, position=light.position)


def _sentence(name: str, lamp: FoundLamp, photos: int) -> str:
    source = f"from {counted(photos, 'photo')}"
    error = lamp.standard_error
    if isinstance(lamp.light, DistantLight):
        return f"Light {name!r}: direction found {source}, ± {np.degrees(error):.1f}°."
    if isinstance(lamp.light, MountedLight):
        right, down, forward = lamp.light.offset
        return (
            f"Light {name!r}: flash found {source}, {right:.3g} right, {down:.3g} down and "
            f"{forward:.3g} forward of the lens, ± {error:.2g} scan units."
        )
    return f"Light {name!r}: position found {source}, ± {error:.2g} scan units."
