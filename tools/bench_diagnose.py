"""Run `diagnose` on real photographs, on the demo, and on eight photos of one megapixel."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from .bench_speed_scene import make_capture
from .common import ROOT

MEGAPIXELS, TRIANGLES = 1.0, 100_000  # of the capture whose time counts
DEMO = ROOT / "assets" / "demo" / "demo.capture.toml"


def run(data: Path) -> None:
    """Print one row per capture, then the sentences of the diagnosis."""
    from . import real_captures

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        captures = {
            "DiLiGenT ball": real_captures.ball(data, folder),
            "Rodin bronze, sRGB, flash at the lens": real_captures.rodin(
                data, folder, chart=False, refine=False
            ),
            "demo": DEMO,
            "8 photos of 1 MP, 100,000 faces": make_capture(folder / "fast", MEGAPIXELS, TRIANGLES),
        }
        print(
            "| capture | named | error on held-out regions, before → after | on held-out photos | "
            "error ÷ noise floor | seconds: total, search |\n|---|---|---|---|---|---|"
        )
        sentences = []
        for label, path in captures.items():
            sentences += [f"- {label}: {sentence}" for sentence in _row(label, path)]
        print("\n" + "\n".join(sentences))


def _row(label: str, path: Path) -> list[str]:
    """Print the row of a capture; return the sentences on causes and materials."""
    from patina.core.capture import read_capture
    from patina.core.jobs import FitJob
    from patina.core.jobs.check_job import CheckJob

    start = time.perf_counter()
    job = CheckJob(FitJob(read_capture(path)))
    job.drain()
    whole = time.perf_counter() - start
    found, after = job.checked.found, job.result
    assert found is not None and after is not None
    search = next(s.seconds for s in job.stages if s.name == "testing possible causes")
    error_before, error_after = found.error_before, found.error_after
    photos = "–"
    if error_before.photos is not None and error_after.photos is not None:
        photos = f"{100 * error_before.photos:.1f} → {100 * error_after.photos:.1f} %"
    print(
        f"| {label} | {', '.join(found.causes) or 'none'} | {100 * error_before.parts:.1f} → "
        f"{100 * error_after.parts:.1f} % | {photos} | {error_before.over_floor:.2f} → "
        f"{error_after.over_floor:.2f} | "
        f"{whole:.0f}, {search:.0f} |",
        flush=True,
    )
    sentences = [found.sentence(trial) for trial in found.reported]
    if found.unexplained:
        sentences.append(found.residual.sentence())
    for before, material in zip(job.checked.result.materials, after.materials, strict=True):
        if before.held_out is not None and material.held_out is not None:
            sentences.append(
                f"{material.name}: error on held-out photos {100 * before.held_out.error:.1f} % in "
                f"the first fit, {100 * material.held_out.error:.1f} % in the second (relative RMS)"
            )
    return sentences
