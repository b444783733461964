"""The rendered scene, and the search for the size of an effect with a given RMS change."""

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
TOLERANCE = 0.08  # relative error of the strength at which the search ends
TRIES = 12
MAX_STRENGTH_ERROR = 0.15  # relative; above it the size is searched for a second time
WHITE = 99.5  # percentile of a photo, including the black background


@dataclass(frozen=True)
class Shot:
    """One photo: its camera, and the unit vector (3,) from the surface to the light."""

    camera: Camera
    light: Array

    @property
    def small(self) -> Shot:
        """The same photo with half the width and height."""
        one = self.camera
        width, height = one.size
        camera = replace(
            one, focal=one.focal / 2, centre=(one.centre[0] / 2, one.centre[1] / 2),
            size=(width // 2, height // 2),
        )  # fmt: skip
        return replace(self, camera=camera)


@dataclass(frozen=True)
class Scene:
    """plain: photos without an effect; strength: requested relative RMS change; kept: cache of
    photos that do not depend on the strength, by name."""

    studio: HuntStudio
    surface: Surface
    brdf: PrincipalBRDF
    shots: list[Shot]
    plain: list[Array]
    strength: float
    rng: np.random.Generator
    kept: dict[str, list[Array]] = field(default_factory=dict)

    def once(self, name: str) -> list[Array]:
        """Render the studio in its present state, or return the cached photos of this name.

        For photos that do not depend on the requested strength.
        """
        if name not in self.kept:
            self.kept[name] = self.photographed()
        return self.kept[name]

    def photographed(self, shots: list[Shot] | None = None) -> list[Array]:
        """Render the studio in its present state."""
        out = []
        for shot in self.shots if shots is None else shots:
            self.studio.light(shot.light, IRRADIANCE)
            out.append(self.studio.photo(shot.camera))
        return out

    @cached_property
    def small(self) -> Scene:
        """The same scene with photos of half the size, which the search for a size uses."""
        shots = [shot.small for shot in self.shots]
        return replace(self, shots=shots, plain=[_halved(p) for p in self.plain])

    def at_strength(
        self,
        photos: Callable[[Scene, float], list[Array]],
        start: float,
        power: float = 1.0,
        most: float = np.inf,
    ) -> tuple[float, list[Array], float]:
        """Find the size that gives the requested strength. Return (size, photos, RMS change).

        The search uses small photos. Outlines and shadow edges, which are ignored, are a larger
        part of these; if the change of the full photos differs too much, the search is repeated.

        photos: renders (scene, size). start, power, most: as for ``find_size``.
        """
        small = self.small

        def change(size: float) -> float:
            return rms(photos(small, size), small.plain)

        size = find_size(change, start, self.strength, power, most)
        found = photos(self, size)
        changed = rms(found, self.plain)
        excess = changed / self.strength
        if abs(excess - 1) < MAX_STRENGTH_ERROR or (size >= most and excess < 1):
            return size, found, changed
        size = find_size(change, size / excess ** (1 / power), self.strength / excess, power, most)
        found = photos(self, size)
        return size, found, rms(found, self.plain)

    def in_part(self, whole: list[Array], name: str, most: float) -> Hidden:
        """Blend with the photos ``whole`` such that the photos change by the requested RMS.

        For effects that are linear in the light. most: largest fraction of ``whole``.
        """
        base = self.plain
        size = min(most, self.strength / max(rms(whole, base), 1e-9))
        photos = blended(base, whole, size)
        return Hidden(photos, {name: size}, rms(photos, base))


@dataclass(frozen=True)
class Hidden:
    """Photos with an effect. parameters: true values of the effect; strength: RMS change achieved.
    stated_shots, surface: wrong shots and mesh in the capture file, None: the true ones."""

    photos: list[Array]
    parameters: Mapping[str, float] = field(default_factory=dict)
    strength: float = 0.0
    stated_shots: list[Shot] | None = None
    surface: Surface | None = None


def _halved(photo: Array) -> Array:
    """Average blocks of 2 × 2 pixels."""
    height, width, channels = photo.shape
    return photo.reshape(height // 2, 2, width // 2, 2, channels).mean(axis=(1, 3))


def blended(base: list[Array], other: list[Array], part: float) -> list[Array]:
    """Blend two lists of photos; part: fraction of ``other``."""
    return [(1 - part) * b + part * o for b, o in zip(base, other, strict=True)]


def rms(photos: list[Array], plain: list[Array]) -> float:
    """Return the relative RMS difference over all photos.

    Values are clipped at the white level of the exposure. Pixels near outlines are ignored, where
    two renders of the same scene differ by their sampling.
    """
    white = max(float(np.percentile(b, WHITE)) for b in plain)
    difference = size = 0.0
    for photo, other in zip(photos, plain, strict=True):
        a, b = np.minimum(photo, white), np.minimum(other, white)
        level = b.max(axis=2)
        high, low = maximum_filter(level, 3), minimum_filter(level, 3)
        inside = ~maximum_filter((high - low > 0.3 * high) & (high > 0.02 * white), 5)
        difference += float(np.sum((a - b)[inside] ** 2))
        size += float(np.sum(b[inside] ** 2))
    return (difference / size) ** 0.5


def find_size(
    rms_of: Callable[[float], float],
    start: float,
    wanted: float,
    power: float = 1.0,
    most: float = np.inf,
) -> float:
    """Return the size (at most ``most``) at which the photos change by ``wanted``.

    Assumes that the RMS change is proportional to a power of the size. ``power`` is its initial
    exponent, which is updated from the last two evaluations. A size outside the interval that is
    known to contain the solution is replaced by the middle of that interval.
    """
    size, last = start, None
    low, high = 0.0, np.inf
    for _ in range(TRIES):
        found = max(rms_of(size), 1e-9)
        if abs(found / wanted - 1) < TOLERANCE or (size >= most and found < wanted):
            break
        low, high = (size, high) if found < wanted else (low, size)
        if last is not None and abs(np.log(size / last[0])) > 0.02:
            exponent = np.log(found / last[1]) / np.log(size / last[0])
            power = float(np.clip(exponent, 0.4, 3.0))
        last = (size, found)
        size *= float(np.clip((wanted / found) ** (1 / power), 0.1, 10))
        size = min(size, most)
        if low > 0 and not low < size < high:
            size = float(np.sqrt(low * min(high, most)))
    return size


def with_light(shot: Shot, light: Array) -> Shot:
    """Return the shot with another direction of the light."""
    return replace(shot, light=light / np.linalg.norm(light))
