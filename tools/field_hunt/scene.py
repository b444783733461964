"""A scene of the field hunt: three kinds of lamps, and photos under them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..hunt.scene import IRRADIANCE, Scene, Shot
from .renderer import Lamp, Renderer

Array = np.ndarray

DISTANT, NEAR, FLASH = "distant", "near", "flash"
LAMPS = (DISTANT, NEAR, FLASH)
PHOTOS, LIGHTS = 8, 4
AWAY = np.radians([25.0, 60.0, 95.0, 130.0])
"""Angles between distant lights and view, those of the captures in ../shared/data/scans."""
NEAR_AWAY = np.radians([20.0, 45.0, 70.0, 90.0])
NEAR_DISTANCE = (1.6, 3.5)  # of near lamps, in sizes of the object
FLASH_SIDE = (0.03, 0.12)  # of a flash beside the lens, in distances of the camera


@dataclass(frozen=True)
class FieldScene(Scene):
    """renderer: of the surface. lamp: one of LAMPS. positions: (LIGHTS, 3) of near lamps, whose
    irradiance at the origin is IRRADIANCE. offset: (3,) of the flash in the camera's frame, with
    this irradiance at ``distance``, the mean distance of the cameras."""

    renderer: Renderer | None = None
    lamp: str = DISTANT
    positions: Array = field(default_factory=lambda: np.zeros((LIGHTS, 3)))
    offset: Array = field(default_factory=lambda: np.zeros(3))
    distance: float = 1.0

    def photographed(self, shots: list[Shot] | None = None) -> list[Array]:
        """Render all photos, or those of other shots."""
        assert self.renderer is not None
        shots = self.shots if shots is None else shots
        return [self.renderer.photo(s.camera, self.lamp_of(k, s)) for k, s in enumerate(shots)]

    def lamp_of(self, photo: int, shot: Shot) -> Lamp:
        """The lamp of a photo."""
        if self.lamp == DISTANT:
            return Lamp(IRRADIANCE, direction=shot.light)
        if self.lamp == NEAR:
            return Lamp(self.intensity_of(photo // 2), position=self.positions[photo // 2])
        camera = shot.camera
        return Lamp(self.intensity, position=camera.position + camera.rotation.T @ self.offset)

    @property
    def intensity(self) -> float:
        """Irradiance of the flash at distance 1."""
        return IRRADIANCE * self.distance**2

    def intensity_of(self, lamp: int) -> float:
        """Irradiance of a near lamp at distance 1."""
        return IRRADIANCE * float(self.positions[lamp] @ self.positions[lamp])


@dataclass(frozen=True)
class Lighting:
    """Lights drawn for a scene: fields of the same names of FieldScene."""

    shots: list[Shot]
    positions: Array
    offset: Array
    distance: float


def draw_lighting(rng: np.random.Generator, lamp: str, cameras: list) -> Lighting:  # type: ignore[type-arg]
    """Two photos under each of LIGHTS lamps, or a flash on the camera."""
    shots = [Shot(camera, np.zeros(3)) for camera in cameras]
    positions = np.zeros((LIGHTS, 3))
    angles = AWAY if lamp == DISTANT else NEAR_AWAY
    for k in range(LIGHTS):
        away, about = angles[k % len(angles)], rng.uniform(0, 2 * np.pi)
        local = np.array(
            [np.sin(away) * np.cos(about), np.sin(away) * np.sin(about), -np.cos(away)]
        )
        towards = shots[2 * k].camera.rotation.T @ local
        positions[k] = rng.uniform(*NEAR_DISTANCE) * towards
        for place in (2 * k, 2 * k + 1):
            shots[place] = replace(shots[place], light=towards)
    distance = float(np.mean([np.linalg.norm(one.position) for one in cameras]))
    side, about = distance * rng.uniform(*FLASH_SIDE), rng.uniform(0, 2 * np.pi)
    offset = np.array([side * np.cos(about), side * np.sin(about), 0.0])
    return Lighting(shots, positions, offset, distance)
