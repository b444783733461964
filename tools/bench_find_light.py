"""Measure lights found from photos: direction errors, their stated uncertainty, and fits with them.

Simulated captures are in find_light_simulated.py; the bunnies' photos are by another renderer.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from .find_light_simulated import (
    Found,
    degrees_between,
    flashes,
    near_lamps,
    own_captures,
    painted_shapes,
    print_row,
    print_summary,
)
from .near_lamps_simulated import near_or_distant

UNEQUAL = (1.0, 3.0, 0.5, 1.0)  # strengths of the lamps of one bunny


def run(data: Path) -> None:
    """Print the tables of docs/method/measurements.md."""
    from patina.core.light_search.jackknife import RADIUS_90

    print("## lights found from photos: directions (degrees)\n")
    print("| capture | error of each lamp | standard error | fit error, found ÷ true | seconds |")
    print("|---|---|---|---|---|")
    found = [*_bunnies(data), *own_captures()]
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
    flashes()
    near_lamps()
    near_or_distant()
    painted_shapes()
    _strengths(data)
    _real(data)


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
            np.array([degrees_between(one.direction, true.direction) for one, true in pairs]),
            np.array([np.degrees(one.standard_error) for one, _ in pairs]),
            errors[0] / errors[1],
        )
        print_row(name, found, seconds)
        yield found


def _strengths(data: Path) -> None:
    """Relative strengths of lamps: of the bunnies' equal ones, and after scaling the photos."""
    from patina.core.capture import read_capture
    from patina.core.jobs import FitJob
    from patina.core.jobs.find_lights_job import FindLightsJob

    from .experiments.bunnies import BUNNIES

    print("## strengths of lamps relative to one another\n")
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "scan"
        for name, factors in (*((n, None) for n in BUNNIES.values()), ("bunny_red", UNEQUAL)):
            source = data / "scans" / name
            if factors is not None:
                _scale_photos(source, copy, factors)
                source = copy
            capture = read_capture(source / "scan.capture.toml")
            entries = tuple(replace(entry, strength=None) for entry in capture.lights)
            capture = replace(capture, lights=entries)
            job = FindLightsJob(capture, [entry.name for entry in entries])
            job.drain()
            errors = []
            for lights in (entries, job.result.entries):
                fit = FitJob(replace(capture, lights=tuple(lights)))
                fit.drain()
                errors.append(f"{100 * fit.result.materials[0].held_out.typical:.1f} %")
            strengths = [one.relative_strength or 1.0 for one in job.result.entries]
            print(
                f"- {name}, true {list(factors or [1.0] * len(entries))}: found "
                f"{np.round(strengths, 2).tolist()}; typical held-out error {errors[0]} with equal "
                f"strengths, {errors[1]} with found lights and strengths",
                flush=True,
            )
    print()


def _scale_photos(source: Path, copy: Path, factors: Sequence[float]) -> None:
    """Copy a capture, its photos multiplied by the factor of their light."""
    import OpenImageIO as oiio

    from patina.core.capture import read_capture

    shutil.copytree(source, copy)
    capture = read_capture(copy / "scan.capture.toml")
    names = [entry.name for entry in capture.lights]
    for photo in capture.photos:
        image = oiio.ImageBuf(str(photo.file))
        scaled = oiio.ImageBuf(image.spec())
        scaled.set_pixels(
            image.roi, image.get_pixels(oiio.FLOAT) * np.float32(factors[names.index(photo.light)])
        )
        scaled.write(str(photo.file))


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
        errors = [degrees_between(one.direction, true.direction) for one, true in pairs]
        print_summary("DiLiGenT ball", errors, [np.degrees(one.standard_error) for one, _ in pairs])
    for name, errors, spreads in photometric_stereo.found_lights(data / "real" / "psm_uw"):
        print_summary(name, errors, spreads)
