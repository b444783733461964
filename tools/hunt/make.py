"""Make one capture with one hidden effect: `make(folder, cause, strength, seed)`.

The shape, the material, the lights, the cameras and how the effect sits are drawn from the seed.
Its size is searched for such that the photos change by the wanted RMS. The truth is returned, and
never written where a diagnosis could read it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import trimesh
from scipy.ndimage import maximum_filter, minimum_filter

from patina.core.angles import Angles
from patina.core.basis import Basis, PrincipalBRDF

from ..demo_render import Camera
from . import camera_faults
from .shape import lumpy
from .studio import BOUNCES, HuntStudio

Array = np.ndarray

SIZE, FOCAL, DISTANCE = (240, 220), 430.0, 2.2
PHOTOS, LIGHTS = 8, 4
IRRADIANCE = float(np.pi)
AWAY = np.radians([25.0, 60.0, 95.0, 130.0])  # of the lights from the view
TOLERANCE = 0.08  # of the wanted strength
TRIES = 6
WHITE = 99.5  # percentile of a photo, black about the object included


@dataclass(frozen=True)
class Truth:
    """cause; strength: RMS change of the photos, relative, as it came out; numbers: of the effect.
    material: number of the training material; seed."""

    cause: str
    strength: float
    numbers: Mapping[str, float]
    material: int
    seed: int


@dataclass(frozen=True)
class Shot:
    """camera; light: (3,) surface → light."""

    camera: Camera
    light: Array


def make(folder: Path, cause: str, strength: float, seed: int) -> Truth:
    """Write capture, mesh, cameras and photos into ``folder``; strength 0 for "none"."""
    rng = np.random.default_rng([seed, 7])
    studio = HuntStudio()
    surface = lumpy(seed)
    studio.shape(surface)
    basis = Basis.default()
    material, brdf = _material(basis, rng)
    studio.dress(studio.measured(brdf))
    shots = _shots(rng)
    plain = _photograph(studio, shots)
    photos, told, numbers = plain, shots, {}
    if cause != "none":
        photos, told, numbers = MAKERS[cause](studio, shots, plain, strength, rng)
    came_out = _rms(photos, plain) if told is shots else _rms_of_told(studio, told, plain)
    photos = camera_faults.with_noise(photos, rng)
    _write(folder, surface, told, photos)
    return Truth(cause, came_out, numbers, material, seed)


def _material(basis: Basis, rng: np.random.Generator) -> tuple[int, PrincipalBRDF]:
    """One that the basis was made of, and whose highlight these small photos can show: at least
    half as bright 3° beside its middle."""
    assert basis.training is not None
    beside = Angles(np.radians([0.2, 3.0]), np.full(2, np.radians(25.0)), np.full(2, np.pi / 2))
    while True:
        material = int(rng.integers(len(basis.training) // 3))
        brdf = PrincipalBRDF(basis, basis.training[3 * material : 3 * material + 3])
        middle, aside = brdf.evaluate(beside).mean(axis=1)
        if aside > 0.5 * middle:
            return material, brdf


def _shots(rng: np.random.Generator) -> list[Shot]:
    """Two photos under each light; cameras about the object."""
    turn = rng.uniform(0, 2 * np.pi)
    shots = []
    for k in range(PHOTOS):
        around = turn + 2 * np.pi * k / PHOTOS + rng.uniform(-0.15, 0.15)
        up = rng.uniform(-0.3, 0.6)
        eye = DISTANCE * np.array(
            [np.cos(around) * np.cos(up), np.sin(around) * np.cos(up), np.sin(up)]
        )
        forward = -eye / np.linalg.norm(eye)
        right = np.cross(forward, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        centre = (SIZE[0] / 2 + rng.uniform(-12, 12), SIZE[1] / 2 + rng.uniform(-12, 12))
        camera = Camera(rotation, -rotation @ eye, FOCAL, centre, SIZE)
        shots.append(Shot(camera, np.zeros(3)))
    for k in range(LIGHTS):
        pair = (2 * k, 2 * k + 1)
        first = shots[pair[0]].camera
        away, about = AWAY[k % len(AWAY)], rng.uniform(0, 2 * np.pi)
        local = np.array(
            [np.sin(away) * np.cos(about), np.sin(away) * np.sin(about), -np.cos(away)]
        )
        for place in pair:
            shots[place] = replace(shots[place], light=first.rotation.T @ local)
    return shots


def _photograph(studio: HuntStudio, shots: list[Shot]) -> list[Array]:
    out = []
    for shot in shots:
        studio.light(shot.light, IRRADIANCE)
        out.append(studio.photo(shot.camera))
    return out


def _rms(photos: list[Array], plain: list[Array]) -> float:
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


def _rms_of_told(studio: HuntStudio, told: list[Shot], plain: list[Array]) -> float:
    return _rms(_photograph(studio, told), plain)


def _sought(
    rms_of: Callable[[float], float], start: float, wanted: float, power: float = 1.0
) -> float:
    """The size at which the photos change by ``wanted``; rms grows about with a power of it."""
    size = start
    for _ in range(TRIES):
        found = rms_of(size)
        if abs(found / wanted - 1) < TOLERANCE:
            break
        size *= float(np.clip((wanted / max(found, 1e-9)) ** (1 / power), 0.1, 10))
    return size


def _camera_effect(name: str, how: Callable[[list[Array], float], list[Array]], start: float):  # type: ignore[no-untyped-def]
    def made(studio, shots, plain, strength, rng):  # type: ignore[no-untyped-def]
        size = _sought(lambda s: _rms(how(plain, s), plain), start, strength)
        return how(plain, size), shots, {name: size}

    return made


def _tone(studio, shots, plain, strength, rng):  # type: ignore[no-untyped-def]
    sign = rng.choice([-1.0, 1.0])
    size = _sought(lambda s: _rms(camera_faults.tone(plain, 1 + sign * s), plain), 0.05, strength)
    return camera_faults.tone(plain, 1 + sign * size), shots, {"gamma": 1 + sign * size}


def _clipping(studio, shots, plain, strength, rng):  # type: ignore[no-untyped-def]
    low, high = 0.02, 1.0
    for _ in range(20):
        level = (low * high) ** 0.5
        low, high = (
            (level, high)
            if _rms(camera_faults.clipped(plain, level), plain) > strength
            else (low, level)
        )
    return camera_faults.clipped(plain, high), shots, {"level": high}


def _intensity(studio, shots, plain, strength, rng):  # type: ignore[no-untyped-def]
    drift = np.linspace(-1, 1, len(shots)) + 0.4 * rng.standard_normal(len(shots))
    drift -= drift.mean()

    def lit(size: float) -> list[Array]:
        return [p * np.exp(size * d) for p, d in zip(plain, drift, strict=True)]

    size = _sought(lambda s: _rms(lit(s), plain), 0.05, strength)
    return lit(size), shots, {f"photo {k + 1}": size * d for k, d in enumerate(drift)}


def _direction(studio, shots, plain, strength, rng):  # type: ignore[no-untyped-def]
    """The capture file is told other directions than those of the photos."""
    turns = [rng.normal(size=3) for _ in range(LIGHTS)]

    def told(size: float) -> list[Shot]:
        out = []
        for place, shot in enumerate(shots):
            turn = np.cross(turns[place // 2], shot.light)
            moved = shot.light + np.tan(size) * turn / np.linalg.norm(turn)
            out.append(replace(shot, light=moved / np.linalg.norm(moved)))
        return out

    size = _sought(lambda s: _rms_of_told(studio, told(s), plain), np.radians(1.0), strength)
    return plain, told(size), {"angle": size}


def _pose(studio, shots, plain, strength, rng):  # type: ignore[no-untyped-def]
    """The capture's cameras are turned a little, so that their photos lie beside the object."""
    turns = [rng.normal(size=2) for _ in shots]

    def told(size: float) -> list[Shot]:
        out = []
        for shot, turn in zip(shots, turns, strict=True):
            a, b = size * turn / FOCAL
            tilt = np.array([[1, 0, -a], [0, 1, -b], [a, b, 1.0]])
            rotation = np.linalg.qr(tilt @ shot.camera.rotation)[0]
            rotation *= np.sign(np.sum(rotation * shot.camera.rotation, axis=0))
            eye = shot.camera.position
            camera = replace(shot.camera, rotation=rotation, translation=-rotation @ eye)
            out.append(replace(shot, camera=camera))
        return out

    size = _sought(lambda s: _rms_of_told(studio, told(s), plain), 0.3, strength)
    return plain, told(size), {"pixels": size}


def _near(studio, shots, plain, strength, rng):  # type: ignore[no-untyped-def]
    def lit(nearness: float) -> list[Array]:
        out = []
        for shot in shots:
            studio.near(shot.light / max(nearness, 1e-3), IRRADIANCE, np.zeros(3))
            out.append(studio.photo(shot.camera))
        return out

    size = _sought(lambda s: _rms(lit(min(s, 1.2)), plain), 0.1, strength)
    return lit(min(size, 1.2)), shots, {"1 / distance": min(size, 1.2)}


def _in_part(whole, shots, plain, strength, name, most):  # type: ignore[no-untyped-def]
    """Of light that adds up, as much as changes the photos by the wanted RMS."""
    size = min(most, strength / max(_rms(whole, plain), 1e-9))
    return [p + size * (w - p) for p, w in zip(plain, whole, strict=True)], shots, {name: size}


def _room(studio, shots, plain, strength, rng):  # type: ignore[no-untyped-def]
    studio.room(1.0)
    studio.noise_free(100)
    return _in_part(_photograph(studio, shots), shots, plain, strength, "radiance", 1e9)


def _window(studio, shots, plain, strength, rng):  # type: ignore[no-untyped-def]
    at = rng.normal(size=3)
    at[2] = abs(at[2])
    at /= np.linalg.norm(at)
    studio.window(at, 1.0, np.radians(rng.uniform(15, 40)))
    studio.noise_free(128)
    return _in_part(_photograph(studio, shots), shots, plain, strength, "radiance", 1e9)


def _bounced(studio, shots, plain, strength, rng):  # type: ignore[no-untyped-def]
    studio.bounce(BOUNCES)
    studio.noise_free(100)
    return _in_part(_photograph(studio, shots), shots, plain, strength, "part", 1.0)


MAKERS = {
    "light_direction": _direction,
    "light_intensity": _intensity,
    "near_light": _near,
    "ambient_light": _room,
    "environment_reflection": _window,
    "interreflection": _bounced,
    "camera_response": _tone,
    "clipping": _clipping,
    "vignetting": _camera_effect("corner", camera_faults.vignetted, 0.1),
    "veiling_glare": _camera_effect("part", camera_faults.veiled, 0.02),
    "camera_pose": _pose,
}
"""(studio, shots, plain photos, wanted RMS, rng) → (photos, what the capture says of the shots,
the effect's numbers). Of light that adds up (a room, a bounce) photos hold as much as is wanted."""


def _write(folder: Path, surface, shots: list[Shot], photos: list[Array]) -> None:  # type: ignore[no-untyped-def]
    (folder / "lit").mkdir(parents=True, exist_ok=True)
    trimesh.Trimesh(surface.points, surface.triangles, process=False).export(folder / "mesh.ply")
    frames = []
    for k, shot in enumerate(shots):
        camera = shot.camera
        frames.append(
            {
                "file_path": f"view_{k}.jpg", "fl_x": camera.focal, "fl_y": camera.focal,
                "cx": camera.centre[0], "cy": camera.centre[1], "w": SIZE[0], "h": SIZE[1],
                "transform_matrix": camera.to_world.tolist(),
            }
        )  # fmt: skip
    (folder / "transforms.json").write_text(json.dumps({"frames": frames}), "utf-8")
    lines = ["[scan]", 'cameras = "transforms.json"', 'mesh = "mesh.ply"', ""]
    for k in range(LIGHTS):
        direction = ", ".join(f"{v:.6f}" for v in shots[2 * k].light)
        lines += ["[[light]]", f'name = "light {k + 1}"', f"direction = [{direction}]"]
        lines += [f"irradiance = [{IRRADIANCE}, {IRRADIANCE}, {IRRADIANCE}]", ""]
    for k, image in enumerate(photos):
        name = f"lit/photo_{k}.exr"
        spec = oiio.ImageSpec(SIZE[0], SIZE[1], 3, oiio.HALF)
        target = oiio.ImageBuf(spec)
        target.set_pixels(oiio.ROI(), image.astype(np.float32))
        target.write(str(folder / name))
        lines += ["[[photo]]", f'file = "{name}"', f'camera = "view_{k}.jpg"']
        lines += [f'light = "light {k // 2 + 1}"', ""]
    (folder / "hunt.capture.toml").write_text("\n".join(lines), "utf-8")
