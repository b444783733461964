"""What `diagnose` says of captures that nobody made for it: real photographs, and the demo."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from .common import ROOT

DEMO = ROOT / "assets" / "demo" / "demo.capture.toml"


def run(data: Path) -> None:
    """Print a row each, and the sentences."""
    from . import real_captures

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        captures = {
            "DiLiGenT ball": real_captures.ball(data, folder),
            "Rodin bronze, sRGB, flash at the lens": real_captures.rodin(
                data, folder, chart=False, refine=False
            ),
            "demo": DEMO,
        }
        print(
            "| capture | named | error on held-out regions, before → after | on held-out photos | "
            "error ÷ noise floor | seconds: total, search |\n|---|---|---|---|---|---|"
        )
        said = []
        for label, path in captures.items():
            said += [f"- {label}: {sentence}" for sentence in _row(label, path)]
        print("\n" + "\n".join(said))


def _row(label: str, path: Path) -> list[str]:
    """Prints it; returns what was said of causes and materials."""
    from patina.core.capture import read_capture
    from patina.core.jobs import FitJob
    from patina.core.jobs.check_job import CheckJob

    since = time.perf_counter()
    job = CheckJob(FitJob(read_capture(path)))
    job.drain()
    whole = time.perf_counter() - since
    found, after = job.checked.found, job.result
    assert found is not None and after is not None
    search = next(s.seconds for s in job.stages if s.name == "trying what may be wrong")
    one, other = found.error_before, found.error_after
    photos = "–"
    if one.photos is not None and other.photos is not None:
        photos = f"{100 * one.photos:.1f} → {100 * other.photos:.1f} %"
    print(
        f"| {label} | {', '.join(found.causes) or 'none'} | {100 * one.parts:.1f} → "
        f"{100 * other.parts:.1f} % | {photos} | {one.over_floor:.2f} → {other.over_floor:.2f} | "
        f"{whole:.0f}, {search:.0f} |",
        flush=True,
    )
    said = [found.sentence(trial) for trial in found.reported]
    if found.unexplained:
        said.append(found.residual.sentence())
    for before, material in zip(job.checked.result.materials, after.materials, strict=True):
        if before.held_out is not None and material.held_out is not None:
            said.append(
                f"{material.name}: unseen photos by the first fit {100 * before.held_out.error:.1f}"
                f" % off, by the second {100 * material.held_out.error:.1f} % (relative RMS)"
            )
    return said
