"""Effects of the camera: causes of the diagnosis, and others."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from . import camera_faults
from .scene import Hidden, Scene, find_size, rms

Array = np.ndarray

MIN_CLIPPING = 1e-4  # of the brightest value: below white in photos with a mirror-like highlight


def _sized(name: str, apply: Callable[[list[Array], float], list[Array]], start: float):  # type: ignore[no-untyped-def]
    def made(scene: Scene) -> Hidden:
        size = find_size(lambda s: rms(apply(scene.plain, s), scene.plain), start, scene.strength)
        photos = apply(scene.plain, size)
        return Hidden(photos, {name: size}, rms(photos, scene.plain))

    return made


vignetting = _sized("corner", camera_faults.vignetted, 0.1)
veil = _sized("part", camera_faults.veiled, 0.02)


def tone(scene: Scene) -> Hidden:
    """The photos have an unknown power curve."""
    sign = scene.rng.choice([-1.0, 1.0])
    return _sized("gamma − 1", lambda p, s: camera_faults.tone(p, 1 + sign * s), 0.05)(scene)


def clipping(scene: Scene) -> Hidden:
    """Highlights are clipped at an unknown level."""
    low, high = MIN_CLIPPING, 1.0
    for _ in range(20):
        level = (low * high) ** 0.5
        stronger = rms(camera_faults.clipped(scene.plain, level), scene.plain) > scene.strength
        low, high = (level, high) if stronger else (low, level)
    photos = camera_faults.clipped(scene.plain, high)
    return Hidden(photos, {"level": high}, rms(photos, scene.plain))


def smudge(scene: Scene) -> Hidden:
    """A smudge on the lens darkens the same position of every photo."""
    where = scene.rng.uniform(0.35, 0.65, 2)
    wide = scene.rng.uniform(0.06, 0.12)
    return _sized("depth", lambda p, s: camera_faults.smudged(p, where, wide, s), 0.1)(scene)


def moire(scene: Scene) -> Hidden:
    """Stripes fixed to the sensor."""
    turn, period = scene.rng.uniform(0, np.pi), scene.rng.uniform(14, 30)
    return _sized("depth", lambda p, s: camera_faults.striped(p, turn, period, s), 0.05)(scene)


def white_balance(scene: Scene) -> Hidden:
    """One photo has another white balance."""
    which = int(scene.rng.integers(len(scene.plain)))
    gains = scene.rng.normal(size=3)
    gains -= gains.mean()
    return _sized("size", lambda p, s: camera_faults.balanced(p, which, s * gains), 0.1)(scene)
