"""What is photographed, and how much an effect changes the photos."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from patina.core.basis import PrincipalBRDF

from ..demo_render import Camera
from ..demo_shape import Surface
from .studio import HuntStudio

Array = np.ndarray

IRRADIANCE = float(np.pi)
TOLERANCE = 0.08  # of the wanted strength
TRIES = 6
OFF = 0.15  # of the wanted strength, beyond which whole photos are made anew
WHITE = 99.5  # percentile of a photo, black about the object included


@dataclass(frozen=True)
class Shot:
    """camera; light: (3,) surface → light."""

    camera: Camera
    light: Array

    @property
    def small(self) -> Shot:
        """Half as wide and high a photo."""
        one = self.camera
        width, height = one.size
        camera = replace(
            one, focal=one.focal / 2, centre=(one.centre[0] / 2, one.centre[1] / 2),
            size=(width // 2, height // 2),
        )  # fmt: skip
        return replace(self, camera=camera)


@dataclass(frozen=True)
class Scene:
    """plain: the photos without an effect; strength: the wanted RMS change of them; kept: photos
    that do not depend on it, by what they show."""

    studio: HuntStudio
    surface: Surface
    brdf: PrincipalBRDF
    shots: list[Shot]
    plain: list[Array]
    strength: float
    rng: np.random.Generator
    kept: dict[str, list[Array]] = field(default_factory=dict)

    def once(self, name: str) -> list[Array]:
        """Photos of the studio as it is, which is the same whatever the wanted strength is."""
        if name not in self.kept:
            self.kept[name] = self.photographed()
        return self.kept[name]

    def photographed(self, shots: list[Shot] | None = None) -> list[Array]:
        """Photos of the studio as it is."""
        out = []
        for shot in self.shots if shots is None else shots:
            self.studio.light(shot.light, IRRADIANCE)
            out.append(self.studio.photo(shot.camera))
        return out

    @cached_property
    def small(self) -> Scene:
        """The same in photos of half the size, where the strength of an effect is searched for."""
        shots = [shot.small for shot in self.shots]
        return replace(self, shots=shots, plain=[_halved(p) for p in self.plain])

    def made(
        self,
        photos: Callable[[Scene, float], list[Array]],
        start: float,
        power: float = 1.0,
        most: float = np.inf,
    ) -> tuple[float, list[Array], float]:
        """(size, photos of (scene, size), their change) of the wanted strength, sought in small
        photos. Outlines and edges of shadows, which do not count, are a larger part of these: where
        whole ones change otherwise, the size is sought once more."""
        small = self.small

        def change(size: float) -> float:
            return rms(photos(small, size), small.plain)

        size = sought(change, start, self.strength, power, most)
        found = photos(self, size)
        changed = rms(found, self.plain)
        off = changed / self.strength
        if abs(off - 1) < OFF or (size >= most and off < 1):
            return size, found, changed
        size = sought(change, size / off ** (1 / power), self.strength / off, power, most)
        found = photos(self, size)
        return size, found, rms(found, self.plain)

    def in_part(self, whole: list[Array], name: str, most: float) -> Hidden:
        """Of light that adds up, as much as changes the photos by the wanted RMS."""
        base = self.plain
        size = min(most, self.strength / max(rms(whole, base), 1e-9))
        photos = mixed(base, whole, size)
        return Hidden(photos, {name: size}, rms(photos, base))


@dataclass(frozen=True)
class Hidden:
    """photos with an effect in them; numbers: of the effect; strength: RMS change as it came out.
    told, surface: what the capture says of shots and mesh, None: the truth."""

    photos: list[Array]
    numbers: Mapping[str, float] = field(default_factory=dict)
    strength: float = 0.0
    told: list[Shot] | None = None
    surface: Surface | None = None


def _halved(photo: Array) -> Array:
    """Means over squares of two pixels."""
    height, width, channels = photo.shape
    return photo.reshape(height // 2, 2, width // 2, 2, channels).mean(axis=(1, 3))


def mixed(base: list[Array], other: list[Array], part: float) -> list[Array]:
    """Photos of which a part is of the other."""
    return [(1 - part) * b + part * o for b, o in zip(base, other, strict=True)]


def rms(photos: list[Array], plain: list[Array]) -> float:
    """Of all photos at once, relative; up to what a camera would expose to white, and away from
    outlines, where two renders of one thing differ by their sampling."""
    white = max(float(np.percentile(b, WHITE)) for b in plain)
    missed = size = 0.0
    for photo, other in zip(photos, plain, strict=True):
        a, b = np.minimum(photo, white), np.minimum(other, white)
        level = b.max(axis=2)
        high, low = maximum_filter(level, 3), minimum_filter(level, 3)
        calm = ~maximum_filter((high - low > 0.3 * high) & (high > 0.02 * white), 5)
        missed += float(np.sum((a - b)[calm] ** 2))
        size += float(np.sum(b[calm] ** 2))
    return (missed / size) ** 0.5


def sought(
    rms_of: Callable[[float], float],
    start: float,
    wanted: float,
    power: float = 1.0,
    most: float = np.inf,
) -> float:
    """The size at which the photos change by ``wanted``; rms grows about with a power of it, which
    is learnt on the way."""
    size, last = start, None
    for _ in range(TRIES):
        found = max(rms_of(size), 1e-9)
        if abs(found / wanted - 1) < TOLERANCE or (size >= most and found < wanted):
            break
        if last is not None and abs(np.log(size / last[0])) > 0.02:
            learnt = np.log(found / last[1]) / np.log(size / last[0])
            power = float(np.clip(learnt, 0.4, 3.0))
        last = (size, found)
        size *= float(np.clip((wanted / found) ** (1 / power), 0.1, 10))
        size = min(size, most)
    return size


def moved(shot: Shot, light: Array) -> Shot:
    """With another direction of light."""
    return replace(shot, light=light / np.linalg.norm(light))
