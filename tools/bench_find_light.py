"""Measure lights found from photos: direction errors, their stated uncertainty, and fits with them.

Scans of own shapes have the errors of stereo; their photos are made from the exact surface and
measured BRDFs outside the dictionary, and the bunnies by another renderer.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MATERIALS = (
    "acrylic_felt_pink_rgb", "paper_white_rgb", "satin_purple_rgb", "glossyredpaper",
    "cc_iris_purple_gem_rgb", "ilm_l3_37_metallic_rgb",
)  # fmt: skip
"""Of the validation set, from felt to metal: not in the dictionary."""
SCANS = (("jar", "bumpy", 1.5), ("pebble", "wavy", 1.0), ("knot", "blurred", 1.0))
LAMPS, PHOTOS_OF_LAMP = 4, 2
SEED = 100  # of the first capture's cameras, lamps and noise
FLASHES = (
    (0, 2, (0.08, -0.25, 0.05)), (1, 0, (0.0, -0.15, 0.0)), (2, 5, (-0.3, -0.1, 0.1)),
    (0, 3, (0.02, 0.06, 0.0)),
)  # fmt: skip
"""(scan, material, offset right, down, forward of the lens) of the simulated flashes."""


@dataclass(frozen=True)
class Found:
    """error, spread: degrees, of each lamp; ratio: fit error with the found lights ÷ with the true
    ones."""

    error: Array
    spread: Array
    ratio: float = float("nan")


def run(data: Path) -> None:
    """Print the tables of docs/method/measurements.md."""
    from patina.core.light_search.jackknife import RADIUS_90

    print("## lights found from photos: directions (degrees)\n")
    print("| capture | error of each lamp | standard error | fit error, found ÷ true | seconds |")
    print("|---|---|---|---|---|")
    found = [*_bunnies(data), *_own_captures()]
    errors = np.concatenate([one.error for one in found])
    inside = errors <= RADIUS_90 * np.concatenate([one.spread for one in found])
    ratios = np.array([one.ratio for one in found])
    print(
        f"\n{len(errors)} lamps: median {np.median(errors):.2f}°, 90 % "
        f"{np.quantile(errors, 0.9):.2f}°, largest {errors.max():.2f}°; 90 % intervals hold "
        f"{100 * inside.mean():.0f} %; fit error found ÷ true: median "
        f"{np.nanmedian(ratios):.3f}, largest {np.nanmax(ratios):.3f}\n",
        flush=True,
    )
    _flashes()
    _real(data)


def _line(name: str, found: Found, seconds: float) -> None:
    errors = ", ".join(f"{e:.2f}" for e in found.error)
    spreads = ", ".join(f"{e:.2f}" for e in found.spread)
    print(f"| {name} | {errors} | {spreads} | {found.ratio:.3f} | {seconds:.0f} |", flush=True)


def _degrees(one: Array, other: Array) -> float:
    return float(np.degrees(np.arccos(np.clip(one @ other, -1.0, 1.0))))


def _bunnies(data: Path) -> Iterable[Found]:
    from patina.commands.compare import read_truth
    from patina.core.brdf.metrics import compare
    from patina.core.capture import read_capture
    from patina.core.jobs import FitJob
    from patina.core.jobs.find_lights_job import FindLightsJob

    from .experiments.bunnies import BUNNIES

    for name in BUNNIES.values():
        capture = read_capture(data / "scans" / name / "scan.capture.toml")
        start = time.perf_counter()
        job = FindLightsJob(capture, [entry.name for entry in capture.lights])
        job.drain()
        seconds = time.perf_counter() - start
        truth, errors = read_truth(data / "scans" / name / "truth.json"), []
        for lights in (job.result.entries, capture.lights):
            fit = FitJob(replace(capture, lights=tuple(lights)))
            fit.drain()
            table = fit.result.materials[0].fit.brdf.table()
            errors.append(compare(table, truth).log_relative_rms)
        pairs = list(zip(job.result.entries, capture.lights, strict=True))
        found = Found(
            np.array([_degrees(one.direction, true.direction) for one, true in pairs]),
            np.array([np.degrees(one.standard_error) for one, _ in pairs]),
            errors[0] / errors[1],
        )
        _line(name, found, seconds)
        yield found


def _own_captures() -> Iterable[Found]:
    from patina.core.basis import default_basis
    from patina.core.light import DistantLight

    from .experiments import estimators, mesh_error, metrics, scenes, shapes
    from .experiments.materials import materials
    from .experiments.simulate import Shot

    count = 0
    for scan, (shape, kind, degrees) in enumerate(SCANS):
        true = shapes.true_shape(shape)
        mesh = mesh_error.make(kind)(true, degrees, 0)
        for each in range(4):
            material = materials([MATERIALS[(4 * scan + each) % len(MATERIALS)]])[0]
            shots = scenes.rig(SEED + count, LAMPS * PHOTOS_OF_LAMP, scenes.ANGLES)
            lamps = [shot.light for shot in shots[:LAMPS]]
            shots = tuple(Shot(s.camera, lamps[i % LAMPS]) for i, s in enumerate(shots))
            pictures = _pictures(true, shots, material.evaluate, SEED + count)
            start = time.perf_counter()
            lights = [DistantLight(f"lamp {i}", np.array([0.0, 0.0, 1.0])) for i in range(LAMPS)]
            lamp_of = [i % LAMPS for i in range(len(shots))]
            result = _search(mesh, shots, pictures, lights, lamp_of)
            seconds = time.perf_counter() - start
            errors = []
            for used in ([one.light.direction for one in result], [one.direction for one in lamps]):
                towards = [replace(lamp, direction=d) for lamp, d in zip(lamps, used, strict=True)]
                taken = [Shot(s.camera, towards[i]) for s, i in zip(shots, lamp_of, strict=True)]
                table = _samples(mesh, taken, pictures)
                fit = estimators.ours(table, default_basis(), 0)
                errors.append(metrics.errors(fit.evaluate, material.evaluate).log_rms)
            found = Found(
                np.array([
                    _degrees(one.light.direction, lamp.direction)
                    for one, lamp in zip(result, lamps, strict=True)
                ]),
                np.array([np.degrees(one.standard_error) for one in result]),
                errors[0] / errors[1],
            )  # fmt: skip
            _line(f"{shape} ({kind} {degrees:g}°), {material.name}", found, seconds)
            yield found
            count += 1


def _pictures(true, shots, evaluate, seed) -> list[NDArray[np.float32]]:
    """(h, w, 3) noisy photos of the exact surface; a near light's falloff is that of its pixels."""
    from patina.core.geometry import RayScene, view_surface
    from patina.core.light import DistantLight

    from .experiments.simulate import FULL_WELL, READ_NOISE, WHITE, true_pixels

    rays, rng, found = RayScene.build(true), np.random.default_rng(seed), []
    for shot in shots:
        radiance = true_pixels(rays, shot).transport(evaluate).astype(np.float64)
        if isinstance(shot.light, DistantLight):
            radiance *= shot.light.effective_irradiance
        else:
            view = view_surface(rays, shot.camera)
            strength = np.zeros((len(radiance), 3))
            strength[view.pixel] = shot.light.incidence(view.point, shot.camera).irradiance
            radiance *= strength
        white = np.percentile(radiance[radiance.max(axis=1) > 0], WHITE) / FULL_WELL
        deviation = np.sqrt(radiance * white + (READ_NOISE * white) ** 2)
        radiance += deviation * rng.standard_normal(radiance.shape)
        shape = shot.camera.height, shot.camera.width, 3
        found.append(radiance.reshape(shape).astype(np.float32))
    return found


def _search(mesh, shots, pictures, lights, lamp_of) -> Sequence:
    """The found lamps. lamp_of: index of each photo's light."""
    from patina.core.basis import default_basis
    from patina.core.geometry import RayScene
    from patina.core.light_search import UnknownLamp, draw_lamp_pixels, find_lamps
    from patina.core.light_search.brdf_dictionary import BrdfDictionary
    from patina.core.light_search.search import FINE_PIXELS

    rays, rng = RayScene.build(mesh), np.random.default_rng(0)
    count = -(-FINE_PIXELS * len(lights) // len(shots))
    parts = [
        draw_lamp_pixels(
            rays, shot.camera, picture, np.zeros(picture.shape[:2], np.int16), count, rng
        )
        for shot, picture in zip(shots, pictures, strict=True)
    ]
    lamps = [
        UnknownLamp(light, tuple(p for p, k in zip(parts, lamp_of, strict=True) if k == i))
        for i, light in enumerate(lights)
    ]
    return finished(find_lamps(lamps, 1, rays, BrdfDictionary.of(default_basis()))).lamps


def finished(steps):
    """The result of a generator."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def _samples(mesh, shots, pictures):
    """The samples that Patina takes with these lights."""
    from patina.core.geometry import RayScene, view_surface
    from patina.core.samples import Margins, SampleTable, sample_photo
    from patina.core.samples.take import light_surface, trusted_pixels

    rays, tables = RayScene.build(mesh), []
    for shot, picture in zip(shots, pictures, strict=True):
        view = view_surface(rays, shot.camera)
        lighting = light_surface(rays, view, shot.light, shot.camera)
        keep = trusted_pixels(view, lighting, Margins())
        tables.append(sample_photo(view, lighting, picture.reshape(-1, 3), keep))
    return SampleTable.join(tables)


def _flashes() -> None:
    """Simulated flashes on the camera."""
    from patina.core.light import MountedLight

    from .experiments import mesh_error, scenes, shapes
    from .experiments.materials import materials
    from .experiments.simulate import Shot

    print("## flash on the camera, simulated (percent of the camera's distance)\n")
    print("| capture | true offset | found | sideways error | forward error | standard error |")
    print("|---|---|---|---|---|---|")
    for scan, material, offset in FLASHES:
        shape, kind, degrees = SCANS[scan]
        true = shapes.true_shape(shape)
        mesh = mesh_error.make(kind)(true, degrees, 0)
        flash = MountedLight("flash", np.array(offset), np.full(3, 10.0))
        shots = [Shot(shot.camera, flash) for shot in scenes.rig(7, 8, scenes.ANGLES)]
        evaluate = materials([MATERIALS[material]])[0].evaluate
        pictures = _pictures(true, shots, evaluate, 7)
        start = MountedLight("flash", np.zeros(3))
        found = _search(mesh, shots, pictures, [start], [0] * len(shots))[0]
        away = 100 * (found.light.offset - offset) / scenes.DISTANCE
        print(
            f"| {shape}, {MATERIALS[material]} | {offset} | "
            f"{np.round(found.light.offset, 3).tolist()} | {np.hypot(away[0], away[1]):.2f} | "
            f"{abs(away[2]):.2f} | {100 * found.standard_error / scenes.DISTANCE:.2f} |",
            flush=True,
        )
    print()


def _real(data: Path) -> None:
    """Real photographs: a bronze with a flash, and spheres and an owl under known lamps."""
    from patina.core.capture import read_capture
    from patina.core.jobs.find_lights_job import FindLightsJob

    from . import photometric_stereo, real_captures

    print("## real photographs\n")
    with tempfile.TemporaryDirectory() as folder:
        for chart in (False, True):
            capture = read_capture(real_captures.rodin(data, Path(folder), chart, False))
            job = FindLightsJob(capture, ["flash"])
            job.drain()
            print(f"- bronze, {'chart' if chart else 'sRGB'}: {job.result.notes[-1]}", flush=True)
        capture = read_capture(real_captures.ball(data, Path(folder)))
        job = FindLightsJob(capture, [entry.name for entry in capture.lights])
        job.drain()
        pairs = list(zip(job.result.entries, capture.lights, strict=True))
        errors = [_degrees(one.direction, true.direction) for one, true in pairs]
        _summary("DiLiGenT ball", errors, [np.degrees(one.standard_error) for one, _ in pairs])
    for name, errors, spreads in photometric_stereo.found_lights(data / "real" / "psm_uw"):
        _summary(name, errors, spreads)


def _summary(name: str, errors: Sequence[float], spreads: Sequence[float]) -> None:
    listed = ", ".join(f"{e:.1f} ± {s:.1f}" for e, s in zip(errors, spreads, strict=True))
    print(
        f"- {name}: median {np.median(errors):.2f}°, largest {max(errors):.2f}° ({listed})",
        flush=True,
    )
