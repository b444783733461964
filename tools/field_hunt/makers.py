"""Effects of the field hunt that depend on lamps and surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patina.core.angles.vectors import even_directions

from ..hunt.scene import Hidden, Scene, blended, find_size, rms
from . import materials
from .renderer import Lamp
from .scene import FieldScene

Array = np.ndarray

SURFACE_OF_SECOND = (0.10, 0.30)  # fraction of the surface that is another material
MAX_OFFSET = 0.5  # of a flash, in distances of the camera
MAX_INVERSE_DISTANCE = 1.2  # of a lamp, 1 / size of the object
ROOM_DIRECTIONS = 64  # lamps that stand for ambient light


def black_level(scene: Scene) -> Hidden:
    """The camera adds a constant to every pixel."""

    def lifted(size: float) -> list[Array]:
        return [p + size for p in scene.plain]

    white = max(float(np.percentile(p, 99)) for p in scene.plain)
    size = find_size(lambda s: rms(lifted(s), scene.plain), 0.02 * white, scene.strength)
    return Hidden(lifted(size), {"level": size}, rms(lifted(size), scene.plain))


def room(scene: FieldScene) -> Hidden:
    """Uniform ambient light."""
    directions = even_directions(ROOM_DIRECTIONS)
    assert scene.renderer is not None
    alone = [
        sum(
            scene.renderer.photo(shot.camera, Lamp(4 * np.pi / len(directions), direction=d))
            for d in directions
        )
        for shot in scene.shots
    ]

    def lit(radiance: float) -> list[Array]:
        return [p + radiance * a for p, a in zip(scene.plain, alone, strict=True)]

    radiance = find_size(lambda r: rms(lit(r), scene.plain), 0.1, scene.strength)
    return Hidden(lit(radiance), {"radiance": radiance}, rms(lit(radiance), scene.plain))


def near(scene: FieldScene) -> Hidden:
    """Lamps that the capture file states as distant are near, as bright at the object's centre."""

    def photos(scene: FieldScene, size: float) -> list[Array]:
        positions = np.array([scene.shots[2 * k].light for k in range(len(scene.positions))])
        return replace(scene, lamp="near", positions=positions / max(size, 1e-3)).photographed()

    size, found, changed = scene.at_strength(photos, 0.1, most=MAX_INVERSE_DISTANCE)  # type: ignore[arg-type]
    return Hidden(found, {"1 / distance": size}, changed)


def near_elsewhere(scene: FieldScene) -> Hidden:
    """Near lamps stand nearer or farther than the capture file states, as bright at the object."""
    way = scene.rng.uniform(0.5, 1.0, len(scene.positions))
    way *= scene.rng.choice([-1.0, 1.0], len(way))

    def photos(scene: FieldScene, size: float) -> list[Array]:
        factor = np.exp(size * way)[:, None]
        return replace(scene, positions=scene.positions * factor).photographed()

    size, found, changed = scene.at_strength(photos, 0.1, most=0.6)  # type: ignore[arg-type]
    towards = 1 - np.exp(size * way)
    known = {f"displacement {k + 1}": float(one) for k, one in enumerate(towards)}
    return Hidden(found, {"ln distance": size, **known}, changed)


def flash_offset(scene: FieldScene) -> Hidden:
    """The flash is elsewhere on the camera than the capture file states."""
    about = scene.rng.uniform(0, 2 * np.pi)
    way = np.array([np.cos(about), np.sin(about), scene.rng.uniform(-0.5, 0.5)])
    way *= scene.distance / np.linalg.norm(way)

    def photos(scene: FieldScene, size: float) -> list[Array]:
        return replace(scene, offset=scene.offset + size * way).photographed()

    size, found, changed = scene.at_strength(photos, 0.05, most=MAX_OFFSET)  # type: ignore[arg-type]
    away = size * way
    parameters = dict(zip(("right", "down", "forward"), away.tolist(), strict=True))
    return Hidden(found, parameters, changed)


def second_material(scene: FieldScene) -> Hidden:
    """A part of the surface is a mixture with another material."""
    assert scene.renderer is not None
    name = str(scene.rng.choice(materials.names()))
    at = scene.rng.normal(size=3)
    at /= np.linalg.norm(at)
    border = np.quantile(scene.surface.points @ at, 1 - scene.rng.uniform(*SURFACE_OF_SECOND))
    renderer = replace(
        scene.renderer, names=[scene.renderer.names[0], name],
        material=lambda points: (points @ at > border).astype(np.intp),
    )  # fmt: skip
    return scene.in_part(replace(scene, renderer=renderer).photographed(), "part", 1.0)


def shadow(scene: FieldScene) -> Hidden:
    """A disc outside the photos takes a part of one lamp's light."""
    pair = int(scene.rng.integers(2)) * 2  # a light whose lit side the photos show
    light = scene.shots[pair].light
    reach = scene.surface.points @ light
    low, high = np.quantile(reach, [0.4, 0.9])
    front = scene.surface.points[(reach > low) & (reach < high)]
    at = front[scene.rng.integers(len(front))]
    dark = scene.rng.uniform(0.4, 0.8)

    def photos(scene: FieldScene, size: float) -> list[Array]:
        def blocked(points: Array, towards: Array) -> Array:
            away = points - at
            across = away - (away @ light)[:, None] * light
            return (np.linalg.norm(across, axis=1) < size) * 1.0

        assert scene.renderer is not None
        part = replace(scene, renderer=replace(scene.renderer, blocked=blocked))
        again = part.photographed(scene.shots[pair : pair + 2])
        return blended(scene.plain, [*scene.plain[:pair], *again, *scene.plain[pair + 2 :]], dark)

    size, found, changed = scene.at_strength(photos, 0.1, most=1.0)  # type: ignore[arg-type]
    return Hidden(found, {"radius": size, "darkness": dark}, changed)
