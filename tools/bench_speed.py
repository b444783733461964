"""Seconds and peak memory of each stage at real photo sizes, and against the plain way.

Every case runs in a process of its own (this module as a script), so that its peak memory is its
own; captures are made in a temporary folder.
"""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .common import ROOT

PHOTOS = 8
SIZES = ((1, 100_000), (6, 100_000), (24, 100_000), (1, 1_000_000), (6, 1_000_000),
         (24, 1_000_000), (1, 5_000_000), (24, 5_000_000))  # fmt: skip
PLAIN = (6, 100_000)  # megapixels, triangles that the plain way can hold
SELECTIONS = ((10_000_000, 6), (10_000_000, 12), (10_000_000, 20))
PLAIN_SELECTIONS = ((20_000, 6), (3_000, 20))


def run(data: Path) -> None:
    """Print the tables of docs/measurements.md, section "Speed and memory"."""
    print(f"## speed ({PHOTOS} photos, half-float EXR; 2 threads)\n")
    print("| photos | triangles | samples | scan | rays ready | samples taken | paper's fit "
          "| all | processor time | peak memory |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for megapixels, triangles in SIZES:
            where = Path(folder) / f"{megapixels}_{triangles}"
            _case("make", where, megapixels, triangles)
            found = _case("job", where, 2)
            s = found["seconds"]
            print(
                f"| {megapixels} MP | {triangles:,} | {found['samples']:,} | {s['scan']:.1f} s | "
                f"{s['rays']:.1f} s | {s['samples']:.1f} s | {s['fit']:.1f} s | "
                f"{sum(s.values()):.1f} s | {found['processor']:.1f} s | "
                f"{found['peak_mb']:.0f} MB |",
                flush=True,
            )
            if (megapixels, triangles) == PLAIN:
                plain = _case("plain", where)
                quick, quick_work = sum(s.values()), found["processor"]
            _remove(where)
        print(
            f"\nthe plain way, {PLAIN[0]} MP and {PLAIN[1]:,} triangles: {plain['seconds']:.1f} s, "
            f"{plain['peak_mb']:.0f} MB; ours {quick:.1f} s: {plain['seconds'] / quick:.1f} times; "
            f"processor time {plain['processor']:.1f} s to {quick_work:.1f} s: "
            f"{plain['processor'] / quick_work:.1f} times\n"
        )
    print("| candidates | n | condition number | selection | peak memory |")
    print("|---|---|---|---|---|")
    for candidates, count in SELECTIONS:
        found = _case("select", candidates, count)
        print(f"| {candidates:,} | {count} | {found['condition']:.2f} | {found['seconds']:.1f} s | "
              f"{found['peak_mb']:.0f} MB |", flush=True)  # fmt: skip
    print()
    for candidates, count in PLAIN_SELECTIONS:
        found = _case("compare", candidates, count)
        print(
            f"- {candidates:,} candidates, n = {count}: plain {found['plain']:.2f} s (condition "
            f"number {found['plain_condition']:.3f}), ours {found['ours']:.3f} s "
            f"({found['condition']:.3f}): {found['plain'] / found['ours']:.0f} times",
            flush=True,
        )
    print()


def _case(*words: object) -> dict[str, Any]:
    command = [sys.executable, "-m", "tools.bench_speed", *map(str, words)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def _remove(folder: Path) -> None:
    import shutil

    shutil.rmtree(folder)


def _peak() -> float:
    from patina.core.job.job import peak_memory

    return peak_memory() or float("nan")


def _make(folder: str, megapixels: str, triangles: str) -> dict[str, Any]:
    from .bench_speed_scene import make_capture

    make_capture(Path(folder), float(megapixels), int(triangles), PHOTOS)
    return {}


def _opened(folder: str):  # type: ignore[no-untyped-def]
    """(capture, scan, seconds to read the scan)."""
    from patina.core.basis import Basis
    from patina.core.capture import read_capture
    from patina.core.job import inputs

    Basis.default()
    since = time.perf_counter()
    capture = read_capture(Path(folder) / "ball.capture.toml")
    scan = inputs.open_scan(capture)
    return capture, scan, time.perf_counter() - since


def _job(folder: str, threads: str) -> dict[str, Any]:
    from patina.core.basis import Basis
    from patina.core.fit import fit_paper
    from patina.core.geometry import RayScene
    from patina.core.job.job import drained
    from patina.core.job.lights import find_lights
    from patina.core.job.photos import LitPhotos
    from patina.core.job.sampling import take_samples

    worked = time.process_time()
    capture, scan, reading = _opened(folder)
    marks = [time.perf_counter()]
    rays = RayScene.build(scan.mesh)
    photos = LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    marks.append(time.perf_counter())
    taken = drained(take_samples(capture, scan, rays, photos, lights, threads=int(threads)))
    marks.append(time.perf_counter())
    name = capture.materials[0].name
    fit_paper(taken.kept[name].table(), Basis.default(), capture.fit.paper)
    marks.append(time.perf_counter())
    steps = [b - a for a, b in itertools.pairwise(marks)]
    seconds = dict(zip(("scan", "rays", "samples", "fit"), (reading, *steps), strict=True))
    return {
        "seconds": seconds, "samples": int(taken.counts[name].sum()), "peak_mb": _peak(),
        "processor": time.process_time() - worked,
    }  # fmt: skip


def _plain(folder: str) -> dict[str, Any]:
    """Every pixel of a photo at once in float64, all samples of all photos kept, a condition number
    from a decomposition for every candidate."""
    from patina.core.basis import Basis
    from patina.core.fit import fit_paper, selection
    from patina.core.geometry import RayScene
    from patina.core.job import inputs
    from patina.core.job.lights import find_lights
    from patina.core.job.photos import LitPhotos
    from patina.core.samples import SampleTable

    from .plain_sampling import sample_plainly
    from .plain_selection import choose_plainly

    worked = time.process_time()
    capture, scan, reading = _opened(folder)
    since = time.perf_counter()
    rays = RayScene.build(scan.mesh)
    photos = LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    tables = []
    for place in range(len(capture.photos)):
        camera = inputs.camera_of(capture, scan, place)
        light = lights.of(capture, place)
        radiance = photos.read(place).radiance
        tables.append(sample_plainly(rays, camera, light, radiance, capture.fit.margins))
    selection.choose = choose_plainly
    fit_paper(SampleTable.join(tables), Basis.default(), capture.fit.paper)
    seconds = reading + time.perf_counter() - since
    return {"seconds": seconds, "processor": time.process_time() - worked, "peak_mb": _peak()}


def _candidates(count: int, components: int):  # type: ignore[no-untyped-def]
    """(angles, rows (count, components)) of random directions within what photos see."""
    import numpy as np

    from patina.core.angles import Angles
    from patina.core.basis import Basis

    u = np.random.default_rng(0).random((3, count), np.float32)
    angles = Angles(np.radians(60) * u[0] ** 1.5, np.radians(75) * u[1], np.pi * u[2])
    rows = np.empty((count, components), np.float32)
    for begin in range(0, count, 1 << 17):
        part = slice(begin, begin + (1 << 17))
        rows[part] = Basis.default().rows(Angles(*(a[part] for a in angles)), components)[1]
    return angles, rows


def _select(candidates: str, count: str) -> dict[str, Any]:
    import numpy as np

    from patina.core.fit.candidate_tree import angle_cells
    from patina.core.fit.selection import choose_from_cells

    angles, rows = _candidates(int(candidates), int(count))
    since = time.perf_counter()
    chosen = choose_from_cells(rows, angle_cells(angles), int(count))
    seconds = time.perf_counter() - since
    condition = float(np.linalg.cond(rows[chosen]))
    return {"seconds": seconds, "condition": condition, "peak_mb": _peak()}


def _compare(candidates: str, count: str) -> dict[str, Any]:
    import numpy as np

    from patina.core.fit.selection import choose

    from .plain_selection import choose_plainly

    _, rows = _candidates(int(candidates), int(count))
    marks = [time.perf_counter()]
    plain = choose_plainly(rows, int(count), lambda chosen: np.ones(len(rows), bool))
    marks.append(time.perf_counter())
    ours = choose(rows, int(count))
    marks.append(time.perf_counter())
    return {
        "plain": marks[1] - marks[0], "plain_condition": float(np.linalg.cond(rows[plain])),
        "ours": marks[2] - marks[1], "condition": float(np.linalg.cond(rows[ours])),
    }  # fmt: skip


if __name__ == "__main__":
    from .package import load_patina

    load_patina()
    cases: dict[str, Callable[..., dict[str, Any]]] = {
        "make": _make, "job": _job, "plain": _plain, "select": _select, "compare": _compare,
    }  # fmt: skip
    print(json.dumps(cases[sys.argv[1]](*sys.argv[2:])))
