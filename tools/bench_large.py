"""Measure time and memory of materials that vary with as many photos as a farm gets.

The capture is made by a script: a painted ball in 100 JPEGs of 24 megapixels.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from .common import ROOT

CASES = ((16, 3, 100_000), (100, 24, 1_000_000))  # photos, megapixels, triangles


def run(_: Path) -> None:
    """Print the table of docs/method/varying.md."""
    print("| photos | faces | nodes | fit | all | peak memory, fit | all |\n" + "|---" * 7 + "|")
    for case in CASES:
        with tempfile.TemporaryDirectory() as folder:
            made = [sys.executable, "-m", "tools.bench_large", folder, *map(str, case)]
            done = subprocess.run(made, cwd=ROOT, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr)
        found = json.loads(done.stdout.splitlines()[-1])
        print(
            f"| {case[0]} of {case[1]} MP | {case[2]:,} | {found['nodes']:,} | "
            f"{found['fit']:.0f} s | {found['all']:.0f} s | {found['fit_mb']:.0f} MB | "
            f"{found['all_mb']:.0f} MB |",
            flush=True,
        )


def measure(folder: Path, photos: int, megapixels: float, triangles: int) -> dict[str, Any]:
    """Seconds and peak memory of a fit, and of all with the variation. Makes the capture in another
    process, so that its memory does not count."""
    import patina
    from patina.core.concurrency.job import peak_memory
    from patina.core.jobs import FitJob, finished
    from patina.core.jobs.varying.varying_job import VaryingJob

    code = (
        "from tools.package import load_patina; load_patina(); from pathlib import Path; "
        "from tools.bench_speed_scene import make_capture; "
        f"make_capture(Path({str(folder)!r}), {megapixels}, {triangles}, {photos}, True)"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)
    since = time.perf_counter()
    job = FitJob(patina.load_capture(folder / "ball.capture.toml"), portable=False)
    job.drain()
    fitted, fit_mb = time.perf_counter() - since, peak_memory()
    more = VaryingJob(job)
    more.drain()
    varying = finished(more.result).varying
    return {
        "fit": fitted, "all": time.perf_counter() - since, "fit_mb": fit_mb,
        "all_mb": peak_memory(), "nodes": 0 if varying is None else len(varying.grid),
    }  # fmt: skip


if __name__ == "__main__":
    from .package import load_patina

    load_patina()
    place, photos, megapixels, triangles = sys.argv[1:]
    print(json.dumps(measure(Path(place), int(photos), float(megapixels), int(triangles))))
