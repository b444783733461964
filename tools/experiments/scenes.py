"""The captures that estimators are compared on: a true shape, its scan, shots, and unseen shots."""

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
"""Degrees from view to light, as in the scans of the reference data: two photos each."""
ORDER = (60.0, 25.0, 95.0, 130.0)
"""The same in the order that own shapes' first photos have."""
SIZE = (560, 480)  # pixels of the own shapes' photos
FOCAL = 1150.0
DISTANCE = 2.6
LIT = 8  # photos


@dataclass(frozen=True)
class Scene:
    """shots: the lit photos, 16 where there are so many (experiments use the first eight);
    unseen: shots that no estimator is given."""

    name: str
    true: Mesh
    scanned: Mesh
    shots: tuple[Shot, ...]
    unseen: tuple[Shot, ...]

    def sampled(self, photos: int = LIT) -> Sampled:
        """What the program takes from the scan."""
        return sample_scanned(self.true, self.scanned, self.shots[:photos])

    def oracle(self, photos: int = LIT) -> Sampled:
        """The same with the true surface for a scan."""
        return sample_scanned(self.true, self.true, self.shots[:photos])

    def elsewhere(self) -> Sampled:
        """The unseen shots, through the scan."""
        return sample_scanned(self.true, self.scanned, self.unseen)


def light_at(camera: Camera, centre: np.ndarray, degrees: float, azimuth: float) -> DistantLight:
    """A distant light of irradiance π so many degrees from the view of ``centre``; azimuth 0 is to
    the photo's right, 90° above."""
    view = camera.pose.centre - centre
    view = view / np.linalg.norm(view)
    right, down = camera.pose.rotation[0], camera.pose.rotation[1]
    across = np.cos(azimuth) * right - np.sin(azimuth) * down
    across = across - (across @ view) * view
    across = across / np.linalg.norm(across)
    direction = np.cos(np.radians(degrees)) * view + np.sin(np.radians(degrees)) * across
    return DistantLight("lamp", direction, np.full(3, np.pi))


def rig(seed: int, count: int, angles: tuple[float, ...]) -> tuple[Shot, ...]:
    """Cameras around an own shape, lights in turn at the given angles from the view.

    Cameras go around by the golden angle, so that any first n of them surround the object.
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
    """An own shape with 16 shots and a scan of chosen error."""
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
    """A scanned bunny with its own eight lit shots; unseen: eight other cameras of the scan."""
    _, scan, shots = bunnies.opened(tool)
    true = bunnies.true_bunny()
    centre = true.vertices.mean(axis=0)
    cameras = bunnies.other_cameras(tool)
    rng = np.random.default_rng(3)
    some = [cameras[i] for i in np.linspace(0, len(cameras) - 1, LIT).astype(int)]
    unseen = tuple(
        Shot(camera, light_at(camera, centre, degrees, np.radians(rng.uniform(-30, 210))))
        for camera, degrees in zip(some, ORDER * 2, strict=True)
    )
    return Scene(f"bunny, {tool}", true, scan.mesh, shots, unseen)


SCENES: dict[str, Callable[[], Scene]] = {
    "bunny-mve": lambda: bunny_scene("MVE"),
    "bunny-openmvs": lambda: bunny_scene("OpenMVS"),
    "pebble-wavy": lambda: own_scene("pebble", "wavy", 1.0),
    "jar-bumpy": lambda: own_scene("jar", "bumpy", 1.5),
    "bunny-refined": lambda: bunny_scene("OpenMVS refined"),
    "knot-blurred": lambda: own_scene("knot", "blurred", 1.0),
}
"""The captures of the table of goals."""


@lru_cache(maxsize=6)
def scene(name: str) -> Scene:
    """One of SCENES."""
    return SCENES[name]()


@lru_cache(maxsize=8)
def sampled(name: str, what: str = "sampled") -> Sampled:
    """Geometry of a scene's samples, kept: what is "sampled", "oracle" or "elsewhere"."""
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
