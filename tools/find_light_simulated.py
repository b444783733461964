"""Lights found from simulated photos: distant lamps, flashes, near lamps and painted surfaces.

Scans of own shapes have the errors of stereo; their photos are made from the exact surface and
measured BRDFs outside the dictionary.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

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
PAINTS = ("satin_purple_rgb", "paper_white_rgb", "glossyredpaper")  # of the three scans
NEAR = (
    (1.2, -0.6, 1.4),
    (-0.8, 0.5, 1.0),
    (0.3, 2.5, 1.5),
)  # positions of near lamps
PATCH_WAVELENGTH = 0.25


@dataclass(frozen=True)
class Found:
    """error, spread: degrees, of each lamp; ratio: fit error with the found lights ÷ with the true
    ones."""

    error: Array
    spread: Array
    ratio: float = float("nan")


def own_captures() -> Iterable[Found]:
    """Search and fit each own capture; print its row."""
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
            pictures = simulated_pictures(true, shots, material.evaluate, SEED + count)
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
                    degrees_between(one.light.direction, lamp.direction)
                    for one, lamp in zip(result, lamps, strict=True)
                ]),
                np.array([np.degrees(one.standard_error) for one in result]),
                errors[0] / errors[1],
            )  # fmt: skip
            print_row(f"{shape} ({kind} {degrees:g}°), {material.name}", found, seconds)
            yield found
            count += 1


def flashes() -> None:
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
        pictures = simulated_pictures(true, shots, evaluate, 7)
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


def near_lamps() -> None:
    """Simulated lamps near the object."""
    from patina.core.light import NearLight

    from .experiments import mesh_error, scenes, shapes
    from .experiments.materials import materials
    from .experiments.simulate import Shot

    print("## lamp near the object, simulated\n")
    print("| capture | direction error | distance error | standard error ÷ distance |")
    print("|---|---|---|---|")
    for (shape, kind, degrees), material, position in zip(SCANS, PAINTS, NEAR, strict=True):
        true = shapes.true_shape(shape)
        mesh = mesh_error.make(kind)(true, degrees, 0)
        lamp = NearLight("lamp", np.array(position), np.full(3, 10.0))
        shots = [Shot(shot.camera, lamp) for shot in scenes.rig(9, 6, scenes.ANGLES)]
        pictures = simulated_pictures(true, shots, materials([material])[0].evaluate, 9)
        start = NearLight("lamp", np.zeros(3))
        found = _search(mesh, shots, pictures, [start], [0] * len(shots))[0]
        towards = np.array(position) - shapes.CENTRE
        other = found.light.position - shapes.CENTRE
        far, near = np.linalg.norm(towards), np.linalg.norm(other)
        print(
            f"| {shape}, {material} | {degrees_between(towards / far, other / near):.2f}° | "
            f"{100 * abs(near / far - 1):.1f} % | {100 * found.standard_error / far:.1f} % |",
            flush=True,
        )
    print()


def painted_shapes() -> None:
    """Shapes whose albedo varies by 4 : 1 in patches, under three lamps with two photos each."""
    from patina.core.light import DistantLight

    from .experiments import mesh_error, scenes, shapes
    from .experiments.materials import materials
    from .experiments.simulate import Shot

    waves = shapes.waves(PATCH_WAVELENGTH, 9)
    print("## albedo of 4 : 1 in patches\n")
    errors, spreads = [], []
    for (shape, kind, degrees), material in zip(SCANS, PAINTS, strict=True):
        true = shapes.true_shape(shape)
        mesh = mesh_error.make(kind)(true, degrees, 0)
        shots = scenes.rig(9, 6, scenes.ANGLES)
        lamps = [shot.light for shot in shots[:3]]
        shots = [Shot(shot.camera, lamps[i % 3]) for i, shot in enumerate(shots)]
        pictures = simulated_pictures(
            true, shots, materials([material])[0].evaluate, 9,
            lambda points: np.where(waves(points) > 0, 1.0, 0.25),
        )  # fmt: skip
        lights = [DistantLight(f"lamp {i}", np.array([0.0, 0.0, 1.0])) for i in range(3)]
        for one, true_lamp in zip(
            _search(mesh, shots, pictures, lights, [i % 3 for i in range(6)]), lamps, strict=True
        ):
            errors.append(degrees_between(one.light.direction, true_lamp.direction))
            spreads.append(np.degrees(one.standard_error))
    print_summary("painted shapes", errors, spreads)
    print()


def simulated_pictures(true, shots, evaluate, seed, albedo=None) -> list[NDArray[np.float32]]:
    """(h, w, 3) noisy photos of the exact surface; a near light's falloff is that of its pixels.
    albedo: (n, 3) points → (n,) factors."""
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
        if albedo is not None:
            view = view_surface(rays, shot.camera)
            radiance[view.pixel] *= albedo(view.point)[:, None]
        white = np.percentile(radiance[radiance.max(axis=1) > 0], WHITE) / FULL_WELL
        deviation = np.sqrt(radiance * white + (READ_NOISE * white) ** 2)
        radiance += deviation * rng.standard_normal(radiance.shape)
        shape = shot.camera.height, shot.camera.width, 3
        found.append(radiance.reshape(shape).astype(np.float32))
    return found


def _search(mesh, shots, pictures, lights, lamp_of) -> Sequence:
    """The found lamps. lamp_of: index of each photo's light."""
    from patina.core.basis import default_basis
    from patina.core.concurrency.steps import drained
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
    return drained(find_lamps(lamps, 1, rays, BrdfDictionary.of(default_basis()))).lamps


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


def degrees_between(one: Array, other: Array) -> float:
    """Angle between unit vectors (3,)."""
    return float(np.degrees(np.arccos(np.clip(one @ other, -1.0, 1.0))))


def print_row(name: str, found: Found, seconds: float) -> None:
    """Print a row of the table of directions."""
    errors = ", ".join(f"{e:.2f}" for e in found.error)
    spreads = ", ".join(f"{e:.2f}" for e in found.spread)
    print(f"| {name} | {errors} | {spreads} | {found.ratio:.3f} | {seconds:.0f} |", flush=True)


def print_summary(name: str, errors: Sequence[float], spreads: Sequence[float]) -> None:
    """Print median, largest and all errors with their standard errors, degrees."""
    listed = ", ".join(f"{e:.1f} ± {s:.1f}" for e, s in zip(errors, spreads, strict=True))
    print(
        f"- {name}: median {np.median(errors):.2f}°, largest {max(errors):.2f}° ({listed})",
        flush=True,
    )
