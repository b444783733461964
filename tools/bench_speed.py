"""Measure time and peak memory of each stage at real photo sizes, and compare with simple code.

Every case runs in a separate process (this module as a script), so that its peak memory is not
affected by others. Captures are created in a temporary folder.
"""

from __future__ import annotations

import hashlib
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
         (24, 1_000_000), (1, 5_000_000), (6, 5_000_000), (24, 5_000_000))  # fmt: skip
MANY_PHOTOS = (6, 100_000, 16)
SMALL = (6, 100_000)  # megapixels, triangles: the largest case for the simple implementation
SELECTIONS = ((10_000_000, 6), (10_000_000, 12), (10_000_000, 20))
PLAIN_SELECTIONS = ((20_000, 6), (3_000, 20))
STAGES = {
    "reading the scan": "scan",
    "sampling the photos": "samples",
}  # all other stages are part of the fit
WITHOUT = ("Principled", "assigning materials")  # stages after the coefficients are known


def run(data: Path) -> None:
    """Print the tables of docs/method/measurements.md, section "Speed and memory"."""
    with tempfile.TemporaryDirectory() as folder:
        _jobs(Path(folder))
    _selections()


def _jobs(folder: Path) -> None:
    print("## speed (half-float EXR, 2 threads, the default estimator)\n")
    print("| photos | triangles | samples | used | scan and ray casting ready | sampling | fit "
          "| to coefficients | processor time | peak memory, sampling | all | report "
          "| with it |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    comparisons = []
    for megapixels, triangles, photos in (*((*size, PHOTOS) for size in SIZES), MANY_PHOTOS):
        where = folder / f"{megapixels}_{triangles}_{photos}"
        case("make", where, megapixels, triangles, photos)
        found = case("job", where, 2, "measured")
        s = found["seconds"]
        print(
            f"| {photos} of {megapixels} MP | {triangles:,} | {found['samples']:,} | "
            f"{found['used']:,} | {s['scan']:.1f} s | {s['samples']:.1f} s | {s['fit']:.1f} s | "
            f"{sum(s.values()):.1f} s | {found['processor']:.1f} s | "
            f"{found['sampling_mb']:.0f} MB | {found['peak_mb']:.0f} MB | "
            f"{found['report']:.1f} s | {found['report_mb']:.0f} MB |",
            flush=True,
        )
        if (megapixels, triangles, photos) == (*SMALL, PHOTOS):
            comparisons = [_threads(where, found), _plain_way(where)]
        _remove(where)
    print("", *comparisons, "", sep="\n")


def _threads(where: Path, two: dict[str, Any]) -> str:
    one = case("job", where, 1, "measured")
    same = "the same" if one["digest"] == two["digest"] else "NOT the same"
    return (
        f"- on 1 thread {sum(one['seconds'].values()):.1f} s, on 2 "
        f"{sum(two['seconds'].values()):.1f} s: {same} coefficients, byte for byte"
    )


def _plain_way(where: Path) -> str:
    ours, plain = case("job", where, 2, "paper"), case("plain", where)
    seconds = sum(ours["seconds"].values())
    return (
        f"- the paper's fit, {SMALL[0]} MP and {SMALL[1]:,} triangles: simple implementation "
        f"{plain['seconds']:.1f} s, {plain['peak_mb']:.0f} MB; Patina {seconds:.1f} s, "
        f"{ours['peak_mb']:.0f} MB: {plain['seconds'] / seconds:.1f} times faster; processor time "
        f"{plain['processor']:.1f} s to {ours['processor']:.1f} s: "
        f"{plain['processor'] / ours['processor']:.1f} times"
    )


def _selections() -> None:
    print("| candidates | n | condition number | by Nielsen's search | selection | peak memory |")
    print("|---|---|---|---|---|---|")
    for candidates, count in SELECTIONS:
        found = case("select", candidates, count)
        nielsen = case("nielsen", candidates, count)
        print(
            f"| {candidates:,} | {count} | {found['condition']:.2f} | {nielsen['condition']:.2f} "
            f"(with Patina's bounds in {nielsen['seconds']:.0f} s) | {found['seconds']:.1f} s | "
            f"{found['peak_mb']:.0f} MB |",
            flush=True,
        )
    print()
    for candidates, count in PLAIN_SELECTIONS:
        found = case("compare", candidates, count)
        print(
            f"- {candidates:,} candidates, n = {count}: simple search {found['plain']:.2f} s "
            f"(condition number {found['plain_condition']:.3f}), Patina {found['ours']:.3f} s "
            f"({found['condition']:.3f}): {found['plain'] / found['ours']:.0f} times faster",
            flush=True,
        )
    print()


def case(*words: object) -> dict[str, Any]:
    """Run one of the cases in a separate process."""
    command = [sys.executable, "-m", "tools.bench_speed", *map(str, words)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def _remove(folder: Path) -> None:
    import shutil

    shutil.rmtree(folder)


def _peak() -> float:
    from patina.core.concurrency.job import peak_memory

    return peak_memory() or float("nan")


def _make(
    folder: str, megapixels: str, triangles: str, photos: str = str(PHOTOS), painted: str = ""
) -> dict[str, Any]:
    from .bench_speed_scene import make_capture

    make_capture(Path(folder), float(megapixels), int(triangles), int(photos), bool(painted))
    return {}


def _opened(folder: str):  # type: ignore[no-untyped-def]
    """Return (capture, scan, seconds to read the scan)."""
    from patina.core.basis import default_basis
    from patina.core.capture import read_capture
    from patina.core.inputs import capture_data

    default_basis()
    start = time.perf_counter()
    capture = read_capture(Path(folder) / "ball.capture.toml")
    scan = capture_data.open_scan(capture)
    return capture, scan, time.perf_counter() - start


def _job(folder: str, threads: str, method: str) -> dict[str, Any]:
    """Run the fit job and write its report. processor, peak_mb: up to the end of the fit."""
    from dataclasses import replace

    from patina.core.capture import read_capture
    from patina.core.concurrency.job import Step
    from patina.core.jobs import FitJob, finished
    from patina.core.report import write_report

    capture = read_capture(Path(folder) / "ball.capture.toml")
    # the simple implementation has no held-out photos either
    fit = replace(capture.fit, method=method, held_out=method == "measured")
    job = FitJob(replace(capture, fit=fit), threads=int(threads))
    processor_start, processor = time.process_time(), []

    def measure(step: Step) -> None:
        if not step.stage.startswith(WITHOUT):
            processor[:] = [time.process_time() - processor_start]

    job.drain(measure)
    seconds = {"scan": 0.0, "samples": 0.0, "fit": 0.0}
    peak = sampling = 0.0
    for stage in job.stages:
        if not stage.name.startswith(WITHOUT):
            seconds[STAGES.get(stage.name, "fit")] += stage.seconds
            peak = stage.peak_mb or float("nan")  # until this stage
            sampling = peak if STAGES.get(stage.name) else sampling
    result = finished(job.result)
    material = result.materials[0]
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as report:
        for _ in write_report(Path(report), job.result):
            pass
    return {
        "seconds": seconds, "samples": material.samples, "used": material.used, "peak_mb": peak,
        "sampling_mb": sampling, "processor": processor[0],
        "report": time.perf_counter() - start, "report_mb": _peak(),
        "digest": hashlib.sha256(material.fit.brdf.coefficients.tobytes()).hexdigest(),
    }  # fmt: skip


def _varying(folder: str) -> dict[str, Any]:
    """Seconds and peak memory of a fit, and of all with the variation of the surface."""
    from patina.core.capture import read_capture
    from patina.core.jobs import FitJob, finished
    from patina.core.jobs.varying.varying_job import VaryingJob

    since = time.perf_counter()
    job = FitJob(read_capture(Path(folder) / "ball.capture.toml"), portable=False)
    job.drain()
    fitted, fit_mb = time.perf_counter() - since, _peak()
    more = VaryingJob(job)
    more.drain()
    varying = finished(more.result).varying
    return {
        "fit": fitted, "all": time.perf_counter() - since, "fit_mb": fit_mb, "all_mb": _peak(),
        "nodes": 0 if varying is None else len(varying.grid),
    }  # fmt: skip


def _plain(folder: str) -> dict[str, Any]:
    """Run the simple implementation: all pixels of a photo at once in float64, all samples in
    memory, and a singular value decomposition for the condition number of every candidate."""
    from patina.core.basis import default_basis
    from patina.core.fit import fit_paper, selection
    from patina.core.geometry import RayScene
    from patina.core.inputs import capture_data
    from patina.core.inputs.lights import find_lights
    from patina.core.inputs.photos import LitPhotos
    from patina.core.samples import SampleTable

    from .plain_sampling import sample_plainly
    from .plain_selection import choose_plainly

    processor_start = time.process_time()
    capture, scan, reading = _opened(folder)
    start = time.perf_counter()
    rays = RayScene.build(scan.mesh)
    photos = LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    tables = []
    for place in range(len(capture.photos)):
        camera = capture_data.camera_of(capture, scan, place)
        light = lights.of(capture, place)
        radiance = photos.read(place).radiance
        tables.append(sample_plainly(rays, camera, light, radiance, capture.fit.margins))
    selection.choose = choose_plainly
    fit_paper(SampleTable.join(tables), default_basis(), capture.fit.paper)
    seconds = reading + time.perf_counter() - start
    return {
        "seconds": seconds,
        "processor": time.process_time() - processor_start,
        "peak_mb": _peak(),
    }


def _candidates(count: int, components: int):  # type: ignore[no-untyped-def]
    """Return (angles, rows (count, components)) of random directions in the range of photos."""
    import numpy as np

    from patina.core.angles import Angles
    from patina.core.basis import default_basis

    u = np.random.default_rng(0).random((3, count), np.float32)
    angles = Angles(np.radians(60) * u[0] ** 1.5, np.radians(75) * u[1], np.pi * u[2])
    rows = np.empty((count, components), np.float32)
    for begin in range(0, count, 1 << 17):
        part = slice(begin, begin + (1 << 17))
        rows[part] = default_basis().rows(Angles(*(a[part] for a in angles)), components)[1]
    return angles, rows


def _select(candidates: str, count: str) -> dict[str, Any]:
    import numpy as np

    from tools.candidate_search.candidate_tree import angle_cells
    from tools.candidate_search.cell_selection import choose_from_cells

    angles, rows = _candidates(int(candidates), int(count))
    start = time.perf_counter()
    selected = choose_from_cells(rows, angle_cells(angles), int(count))
    seconds = time.perf_counter() - start
    condition = float(np.linalg.cond(rows[selected]))
    return {"seconds": seconds, "condition": condition, "peak_mb": _peak()}


def _nielsen(candidates: str, count: str) -> dict[str, Any]:
    """Nielsen's search over all candidates at every step, accelerated by bounds."""
    import numpy as np

    from patina.core.fit import selection
    from patina.core.fit.condition_bound import ConditionBound
    from tools.candidate_search.candidate_tree import CandidateTree, angle_cells

    angles, rows = _candidates(int(candidates), int(count))
    start = time.perf_counter()
    tree = CandidateTree.of(rows, angle_cells(angles))
    selected = selection.search(
        rows,
        int(np.square(rows).sum(axis=1).argmax()),
        int(count),
        lambda taken, limit: tree.smallest(ConditionBound.of(rows[taken]), taken, limit),
    )
    return {
        "seconds": time.perf_counter() - start,
        "condition": float(np.linalg.cond(rows[selected].astype(float))),
    }


def _compare(candidates: str, count: str) -> dict[str, Any]:
    import numpy as np

    from patina.core.fit.selection import choose

    from .plain_selection import choose_plainly

    _, rows = _candidates(int(candidates), int(count))
    marks = [time.perf_counter()]
    plain = choose_plainly(rows, int(count), lambda selected: np.ones(len(rows), bool))
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
        "make": _make, "job": _job, "plain": _plain, "select": _select, "nielsen": _nielsen,
        "compare": _compare, "varying": _varying,
    }  # fmt: skip
    print(json.dumps(cases[sys.argv[1]](*sys.argv[2:])))
