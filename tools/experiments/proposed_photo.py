"""The ninth photo: the one that Patina proposes, and ninth photos drawn at random.

Eight lit photos are simulated and fitted. Then a ninth is added and all nine are fitted: once with
the camera and the lamp that core/proposed_photo proposes, and RANDOM_PHOTOS times from a random
camera of the scan with a lamp in a random direction. The error is that of ln(ρ·cosθi·cosθo + ε) in
the directions that the eight photos do not show.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from patina.core.brdf.metrics import log_ratio
from patina.core.fit.measured import MeasuredFit, fit_measured
from patina.core.fit.measured_result import MeasuredResult
from patina.core.geometry import RayScene
from patina.core.light import DistantLight
from patina.core.proposed_photo import DirectionUncertainty, MaterialToPhotograph, propose
from patina.core.proposed_photo.candidates import SurfacePoints, chosen_cameras, lamp_directions
from patina.core.samples import SampleTable
from patina.core.scan import Camera

from . import bunnies, materials, metrics, scenes
from .estimators import OUR_COMPONENTS
from .runs import Records
from .simulate import Sampled, Shot, sample_scanned

RIGS = {"around": scenes.ORDER, "beside": (30.0, 15.0, 45.0, 60.0)}
"""Angles between view and light in degrees: lamps all around, and lamps beside the camera."""
SCENES = ("pebble-wavy", "jar-bumpy", "knot-blurred", "bunny-openmvs")
MATERIALS = (
    "acrylic_felt_pink_rgb", "aurora_white_rgb", "cm_military_green_rgb", "greencloth",
    "ilm_l3_37_metallic_rgb", "leaf_maple_rgb", "paper_blue_rgb", "satin_purple_rgb",
)  # fmt: skip
RANDOM_PHOTOS = 2
MIN_ADDED_SAMPLES = 500  # a photo that shows less would be taken again


@dataclass(frozen=True)
class Eight:
    """Eight photos of a scene, and what a ninth can be chosen from. surface: points on the scanned
    mesh. cameras: of the scan."""

    scene: scenes.Scene
    shots: tuple[Shot, ...]
    taken: Sampled
    rays: RayScene
    surface: SurfacePoints
    cameras: list[Camera]


def tasks(quick: bool) -> list[tuple[str, str, str]]:
    """Return (scene, rig, material) of each task."""
    if quick:
        return [(SCENES[0], "around", MATERIALS[-1])]
    return [(scene, rig, name) for scene in SCENES for rig in RIGS for name in MATERIALS]


def work(task: tuple[str, str, str]) -> Records:
    """Return the records of one task."""
    scene, rig, name = task
    (material,) = materials.materials([name])
    basis = materials.basis_for(material, OUR_COMPONENTS)
    eight = eight_photos(scene, rig)
    table = eight.taken.photograph(material.evaluate, 0)
    reference = metrics.Reference.of(material.evaluate)
    seen = metrics.covered(table)

    def ninth(shot: Shot) -> SampleTable:
        found = sample_scanned(eight.scene.true, eight.scene.scanned, [shot])
        return SampleTable.join([found.photograph(material.evaluate, 1)], [len(eight.shots)])

    def record(kind: str, seed: int, fit: MeasuredFit, **others: float) -> dict[str, Any]:
        return {
            "scene": f"{scene}, {rig}", "material": name, "estimator": kind, "seed": seed,
            **errors(fit, reference, seen), **others,
        }  # fmt: skip

    fit = fit_measured(table, basis)
    out = [record("eight photos", 0, fit)]
    lights = [shot.light for shot in eight.shots]
    sought = MaterialToPhotograph(eight.surface, DirectionUncertainty.of(MeasuredResult.of(fit)))
    best = propose(eight.rays, eight.cameras, lights, [sought])
    if best is not None:
        assert best.towards is not None, "the light is not a flash"
        camera = next(camera for camera in eight.cameras if camera.label == best.camera)
        shot = _shot(camera, best.towards)
        again = fit_measured(SampleTable.concatenate([table, ninth(shot)]), basis)
        stated = best.after / best.before
        out.append(record("proposed ninth", 0, again, angle=_angle(shot), stated=stated))
    for seed, (shot, added) in enumerate(_random_photos(eight, ninth, len(name))):
        again = fit_measured(SampleTable.concatenate([table, added]), basis)
        out.append(record("random ninth", seed, again, angle=_angle(shot)))
    return out


def errors(
    fit: MeasuredFit, reference: metrics.Reference, seen: NDArray[np.bool_]
) -> dict[str, float]:
    """Return the RMS error of the logarithm in directions that the eight photos do not show, in
    those at grazing angles, and in all (light and view within 80°)."""
    c = metrics.cells()
    unseen = c.near & ~seen
    found = np.asarray(fit.brdf.evaluate(c.angles), np.float64)
    square = log_ratio(found.T, reference.values.T, c.cos_product) ** 2
    parts = {
        "unseen": unseen,
        "grazing": unseen & (c.angles.theta_d > metrics.GRAZING),
        "log_rms": c.near,
    }
    return {key: float(np.sqrt(square[:, part].mean())) for key, part in parts.items()}


@lru_cache(maxsize=2)
def eight_photos(name: str, rig: str) -> Eight:
    """Return the eight photos of a scene with the lamps of a rig."""
    scene = scenes.scene(name)
    if name.startswith("bunny"):
        cameras = bunnies.other_cameras("OpenMVS")
    else:
        cameras = [shot.camera for shot in (*scene.shots, *scene.test_shots)]
        cameras = [replace(camera, label=f"view_{i:02}") for i, camera in enumerate(cameras)]
    shots = scene.shots[: scenes.LIT]
    if rig != "around":
        centre = scene.true.vertices.mean(axis=0)
        rng = np.random.default_rng(7)
        shots = tuple(
            Shot(s.camera, scenes.light_at(s.camera, centre, a, np.radians(rng.uniform(-30, 210))))
            for s, a in zip(shots, RIGS[rig] * 2, strict=True)
        )
    surface = SurfacePoints.of(scene.scanned, np.arange(len(scene.scanned.faces)))
    assert surface is not None
    return Eight(
        scene, shots, sample_scanned(scene.true, scene.scanned, shots),
        RayScene.build(scene.scanned), surface, cameras,
    )  # fmt: skip


def _random_photos(
    eight: Eight, ninth: Callable[[Shot], SampleTable], seed: int
) -> Iterator[tuple[Shot, SampleTable]]:
    rng = np.random.default_rng(seed)
    centre = eight.surface.point.mean(axis=0)
    lamps = lamp_directions(chosen_cameras(eight.cameras, centre), centre)
    found = 0
    while found < RANDOM_PHOTOS:
        camera = eight.cameras[rng.integers(len(eight.cameras))]
        shot = _shot(camera, lamps[rng.integers(len(lamps))])
        added = ninth(shot)
        if len(added) >= MIN_ADDED_SAMPLES:
            found += 1
            yield shot, added


def _shot(camera: Camera, towards: NDArray[np.float64]) -> Shot:
    return Shot(camera, DistantLight("ninth", towards, np.full(3, np.pi)))


def _angle(shot: Shot) -> float:
    """Angle in degrees between the directions to the camera and to the lamp."""
    cosine = float(-shot.camera.pose.rotation[2] @ shot.light.direction)
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
