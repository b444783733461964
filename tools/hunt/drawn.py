"""Random material, cameras and lights of a capture, drawn from a seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patina.core.angles import Angles
from patina.core.basis import Basis, PrincipalBRDF

from ..demo_render import Camera
from .scene import Shot

Array = np.ndarray

SIZE, FOCAL, DISTANCE = (240, 220), 430.0, 2.2  # pixels, pixels, scan units
PHOTOS, LIGHTS = 8, 4
AWAY = np.radians([25.0, 60.0, 95.0, 130.0])  # angles between light and view, radians


def random_brdf(basis: Basis, rng: np.random.Generator) -> tuple[int, PrincipalBRDF]:
    """Return a random training material of the basis, as (index, BRDF).

    Its highlight must be wide enough for the small photos: at θh = 3° at least half as bright as in
    its middle.
    """
    assert basis.training is not None
    highlight = Angles(np.radians([0.2, 3.0]), np.full(2, np.radians(25.0)), np.full(2, np.pi / 2))
    while True:
        material = int(rng.integers(len(basis.training) // 3))
        brdf = PrincipalBRDF(basis, basis.training[3 * material : 3 * material + 3])
        peak, flank = brdf.evaluate(highlight).mean(axis=1)
        if flank > 0.5 * peak:
            return material, brdf


def random_shots(rng: np.random.Generator) -> list[Shot]:
    """Return PHOTOS shots around the object, two under each of the LIGHTS lights."""
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
