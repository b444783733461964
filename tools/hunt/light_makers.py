"""Effects of light and poses: drifting, near or large lamps, ambient light, bounces, shadows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .drawn import FOCAL
from .scene import IRRADIANCE, Hidden, Scene, Shot, blended, find_size, rms, with_light
from .studio import BOUNCES

Array = np.ndarray

MAX_DIAMETER = np.radians(24.0)  # angular diameter of a lamp
MAX_INVERSE_DISTANCE = 1.2  # of a lamp, 1 / scan unit


def intensity(scene: Scene) -> Hidden:
    """The intensity of the lamp drifts from photo to photo."""
    count = len(scene.shots)
    drift = np.linspace(-1, 1, count) + 0.4 * scene.rng.standard_normal(count)
    drift -= drift.mean()

    def lit(size: float) -> list[Array]:
        return [p * np.exp(size * d) for p, d in zip(scene.plain, drift, strict=True)]

    size = find_size(lambda s: rms(lit(s), scene.plain), 0.05, scene.strength)
    parameters = {f"photo {k + 1}": size * d for k, d in enumerate(drift)}
    return Hidden(lit(size), parameters, rms(lit(size), scene.plain))


def _wrong_capture(scene: Scene, wrong_shots, start: float, name: str) -> Hidden:  # type: ignore[no-untyped-def]
    """The capture file states wrong shots; wrong_shots(scene, size) returns these."""

    def photos(scene: Scene, size: float) -> list[Array]:
        return scene.photographed(wrong_shots(scene, size))

    size, _, changed = scene.at_strength(photos, start)
    return Hidden(scene.plain, {name: size}, changed, stated_shots=wrong_shots(scene, size))


def direction(scene: Scene) -> Hidden:
    """The capture file states wrong directions of the lights."""
    turns = [scene.rng.normal(size=3) for _ in range(len(scene.shots) // 2)]

    def wrong_shots(scene: Scene, size: float) -> list[Shot]:
        out = []
        for place, shot in enumerate(scene.shots):
            turn = np.cross(turns[place // 2], shot.light)
            out.append(with_light(shot, shot.light + np.tan(size) * turn / np.linalg.norm(turn)))
        return out

    return _wrong_capture(scene, wrong_shots, np.radians(1.0), "angle")


def pose(scene: Scene) -> Hidden:
    """The capture file states wrong poses: the cameras are rotated, so that photos are shifted."""
    turns = [scene.rng.normal(size=2) for _ in scene.shots]

    def wrong_shots(scene: Scene, size: float) -> list[Shot]:
        out = []
        for shot, turn in zip(scene.shots, turns, strict=True):
            a, b = size * turn / FOCAL
            tilt = np.array([[1, 0, -a], [0, 1, -b], [a, b, 1.0]])
            rotation = np.linalg.qr(tilt @ shot.camera.rotation)[0]
            rotation *= np.sign(np.sum(rotation * shot.camera.rotation, axis=0))
            eye = shot.camera.position
            camera = replace(shot.camera, rotation=rotation, translation=-rotation @ eye)
            out.append(replace(shot, camera=camera))
        return out

    found = _wrong_capture(scene, wrong_shots, 0.3, "pixels")
    shift = found.parameters["pixels"] * -np.array(turns)
    each = {
        f"photo {k + 1}, {way}": value
        for k, both in enumerate(shift)
        for way, value in zip(("right", "down"), both, strict=True)
    }
    return replace(found, parameters={**found.parameters, **each})


def near(scene: Scene) -> Hidden:
    """A near point lamp, which is as bright at the object's centre as the distant light."""

    def lit(scene: Scene, nearness: float) -> list[Array]:
        out = []
        for shot in scene.shots:
            scene.studio.near(shot.light / max(nearness, 1e-3), IRRADIANCE, np.zeros(3))
            out.append(scene.studio.photo(shot.camera))
        return out

    size, photos, changed = scene.at_strength(lit, 0.1, most=MAX_INVERSE_DISTANCE)
    return Hidden(photos, {"1 / distance": size}, changed)


def area(scene: Scene) -> Hidden:
    """The lamp is a disc."""

    def lit(scene: Scene, size: float) -> list[Array]:
        scene.studio.lamp.data.angle = size
        return scene.photographed()

    scene.studio.noise_free(64)
    size, photos, changed = scene.at_strength(lit, np.radians(8.0), 1.5, MAX_DIAMETER)
    return Hidden(photos, {"angular diameter": size}, changed)


def room(scene: Scene) -> Hidden:
    """Uniform ambient light."""
    scene.studio.room(1.0)
    scene.studio.noise_free(100)
    return _added_to_the_lamp(scene, "room")


def window(scene: Scene) -> Hidden:
    """One bright spot of the environment."""
    at = scene.rng.normal(size=3)
    at[2] = abs(at[2])
    at /= np.linalg.norm(at)
    scene.studio.window(at, 1.0, np.radians(scene.rng.uniform(15, 40)))
    scene.studio.noise_free(128)
    return _added_to_the_lamp(scene, "window")


def _added_to_the_lamp(scene: Scene, name: str) -> Hidden:
    """Render the environment without the lamp and add the images. Rendered together, Cycles chooses
    randomly between the two, and the lamp, which is exact alone, gets the noise of the other."""
    scene.studio.lamp.hide_render = True
    alone = scene.once(name)

    def lit(radiance: float) -> list[Array]:
        return [p + radiance * a for p, a in zip(scene.plain, alone, strict=True)]

    radiance = find_size(lambda r: rms(lit(r), scene.plain), 0.1, scene.strength)
    return Hidden(lit(radiance), {"radiance": radiance}, rms(lit(radiance), scene.plain))


def bounced(scene: Scene) -> Hidden:
    """Interreflection of a bright matte object."""
    scene.studio.dress(scene.studio.matte(scene.rng.uniform(0.75, 0.95, 3)))
    scene.studio.bounce(0)
    once = scene.once("lit once")
    scene.studio.bounce(BOUNCES)
    scene.studio.noise_free(100)
    return replace(scene, plain=once).in_part(scene.once("bounced"), "part", 1.0)


def shadow(scene: Scene) -> Hidden:
    """An object outside the photos blocks a part of one light."""
    pair = int(scene.rng.integers(2)) * 2  # a light whose lit side the photos show
    light = scene.shots[pair].light
    reach = scene.surface.points @ light
    low, high = np.quantile(
        reach, [0.4, 0.9]
    )  # further in front are highlights, where a small spot would suffice
    front = scene.surface.points[(reach > low) & (reach < high)]
    at = front[scene.rng.integers(len(front))] + 1.5 * light
    stretch = scene.rng.uniform(0.5, 2.0)

    dark = scene.rng.uniform(0.4, 0.8)

    def photos(scene: Scene, size: float) -> list[Array]:
        scene.studio.occluder(at, light, size, size * stretch)
        again = scene.photographed(scene.shots[pair : pair + 2])
        return blended(scene.plain, [*scene.plain[:pair], *again, *scene.plain[pair + 2 :]], dark)

    size, found, changed = scene.at_strength(photos, 0.1, most=1.0)
    return Hidden(found, {"radius": size, "darkness": dark}, changed)
