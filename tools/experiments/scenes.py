"""The captures for the comparison: a true shape, its scan, the lit photos and test photos."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from patina.core.light import DistantLight
from patina.core.scan import Camera, Mesh
from patina.core.scan.camera import Pose

from . import bunnies, mesh_error, shapes
from .simulate import Sampled, Shot, sample_scanned

ANGLES = (25.0, 60.0, 95.0, 130.0)
"""Angles between view and light in degrees, two photos each, as in the reference data."""
ORDER = (60.0, 25.0, 95.0, 130.0)
"""The same angles in the order of the photos of the scripted shapes."""
SIZE = (560, 480)  # of the photos of the scripted shapes, pixels
FOCAL = 1150.0  # pixels
DISTANCE = 2.6  # of the cameras, scan units
LIT = 8  # number of lit photos


@dataclass(frozen=True)
class Scene:
    """shots: the lit photos, 8 or 16 (most experiments use the first 8). test_shots: photos that no
    estimator gets, to measure the true error of predictions."""

    name: str
    true: Mesh
    scanned: Mesh
    shots: tuple[Shot, ...]
    test_shots: tuple[Shot, ...]

    def sampled(self, photos: int = LIT) -> Sampled:
        """Return the samples that Patina takes with the scanned mesh."""
        return sample_scanned(self.true, self.scanned, self.shots[:photos])

    def oracle(self, photos: int = LIT) -> Sampled:
        """Return the samples with the true surface instead of the scan."""
        return sample_scanned(self.true, self.true, self.shots[:photos])

    def elsewhere(self) -> Sampled:
        """Return the samples of the test photos, with the scanned mesh."""
        return sample_scanned(self.true, self.scanned, self.test_shots)


def light_at(camera: Camera, centre: np.ndarray, degrees: float, azimuth: float) -> DistantLight:
    """Return a distant light of irradiance π, ``degrees`` from the view direction of ``centre``.

    azimuth: radians; 0 is to the right in the photo, π/2 is up.
    """
    view = camera.pose.centre - centre
    view = view / np.linalg.norm(view)
    right, down = camera.pose.rotation[0], camera.pose.rotation[1]
    across = np.cos(azimuth) * right - np.sin(azimuth) * down
    across = across - (across @ view) * view
    across = across / np.linalg.norm(across)
    direction = np.cos(np.radians(degrees)) * view + np.sin(np.radians(degrees)) * across
    return DistantLight("lamp", direction, np.full(3, np.pi))


def rig(seed: int, count: int, angles: tuple[float, ...]) -> tuple[Shot, ...]:
    """Return cameras around a scripted shape, with lights at the given angles from the view.

    Azimuths of the cameras advance by the golden angle, so that the first n surround the object.
    """
    rng = np.random.default_rng(seed)
    shots = []
    for i in range(count):
        around = 2.399963 * i + rng.uniform(0, 0.3)
        height = np.radians(rng.uniform(5, 45))
        away = np.array(
            [np.cos(around) * np.cos(height), np.sin(around) * np.cos(height), np.sin(height)]
        )
        camera = _camera(f"view_{i:02}", shapes.CENTRE + DISTANCE * away)
        azimuth = np.radians(rng.uniform(-30, 210))  # from the side or above, as a lamp stands
        shots.append(Shot(camera, light_at(camera, shapes.CENTRE, angles[i % 4], azimuth)))
    return tuple(shots)


def own_scene(shape: str, kind: str, degrees: float) -> Scene:
    """Return a scripted shape with 16 shots and a simulated scan of given error."""
    true = shapes.true_shape(shape)
    scanned = mesh_error.make(kind)(true, degrees, 0)
    place = sorted(shapes.FIELDS).index(shape)
    return Scene(
        f"{shape}, {kind} {degrees:g}°",
        true,
        scanned,
        rig(10 + place, 16, ORDER),
        rig(50 + place, LIT, ORDER),
    )


def bunny_scene(tool: str) -> Scene:
    """Return a scanned bunny with its eight lit shots, and eight test shots."""
    _, scan, shots = bunnies.opened(tool)
    true = bunnies.true_bunny()
    centre = true.vertices.mean(axis=0)
    cameras = bunnies.other_cameras(tool)
    rng = np.random.default_rng(3)
    some = [cameras[i] for i in np.linspace(0, len(cameras) - 1, LIT).astype(int)]
    test_shots = tuple(
        Shot(camera, light_at(camera, centre, degrees, np.radians(rng.uniform(-30, 210))))
        for camera, degrees in zip(some, ORDER * 2, strict=True)
    )
    return Scene(f"bunny, {tool}", true, scan.mesh, shots, test_shots)


SCENES: dict[str, Callable[[], Scene]] = {
    "bunny-mve": lambda: bunny_scene("MVE"),
    "bunny-openmvs": lambda: bunny_scene("OpenMVS"),
    "pebble-wavy": lambda: own_scene("pebble", "wavy", 1.0),
    "jar-bumpy": lambda: own_scene("jar", "bumpy", 1.5),
    "bunny-refined": lambda: bunny_scene("OpenMVS refined"),
    "knot-blurred": lambda: own_scene("knot", "blurred", 1.0),
}
"""Scenes of the table of goals."""


@lru_cache(maxsize=6)
def scene(name: str) -> Scene:
    """Return one of SCENES, cached."""
    return SCENES[name]()


@lru_cache(maxsize=8)
def sampled(name: str, what: str = "sampled") -> Sampled:
    """Return the samples of a scene, cached; what: "sampled", "oracle" or "elsewhere"."""
    found = getattr(scene(name), what)()
    if not isinstance(found, Sampled):
        raise TypeError(what)
    return found


def _camera(label: str, position: np.ndarray) -> Camera:
    forward = shapes.CENTRE - position
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    width, height = SIZE
    return Camera(
        label, width, height, "PINHOLE", (FOCAL, FOCAL, width / 2, height / 2),
        Pose(rotation, -rotation @ position),
    )  # fmt: skip
