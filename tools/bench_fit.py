"""The paper's fit on the captures with known truth: errors, time and memory."""

from __future__ import annotations

from pathlib import Path


def run(data: Path) -> None:
    """Print the table of docs/measurements.md, section "The paper's fit"."""
    from patina.commands.compare import read_truth
    from patina.core.brdf import metrics
    from patina.core.capture import read_capture
    from patina.core.job import FitJob

    print("## fit (in-basis: the embedded basis contains the material)\n")
    print(
        "| capture | relative L2 | log RMS to 80 | cube-root RMS | held-out, typical pixel | "
        "held-out, relative RMS | s | MB |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name in ("bunny_bronze", "bunny_red", "bunny_fabric"):
        folder = data / "scans" / name
        job = FitJob(read_capture(folder / "scan.capture.toml"))
        job.drain()
        if job.result is None:
            raise RuntimeError("the job ended without a result")
        material = job.result.materials[0]
        found = metrics.compare(material.fit.brdf.table(), read_truth(folder / "truth.json"))
        held = material.held_out
        if held is None:
            raise RuntimeError("eight photos and none held out")
        seconds = sum(stage.seconds for stage in job.stages)
        peak = job.stages[-1].peak_mb or float("nan")
        print(
            f"| {name} | {found.relative_l2:.3f} | {found.log_relative_rms:.3f} | "
            f"{found.cube_root_rms:.4f} | {100 * held.typical:.1f} % | {100 * held.error:.1f} % | "
            f"{seconds:.1f} | {peak:.0f} |",
            flush=True,
        )
    print()
