"""The paper's fit on the captures with known truth, beside the best that components can do."""

from __future__ import annotations

from pathlib import Path

import numpy as np

COMPONENTS = 20


def run(data: Path) -> None:
    """Print the table of docs/measurements.md, section "The paper's fit"."""
    from patina.commands.compare import read_truth
    from patina.core.angles import Angles, merl_grid
    from patina.core.basis import Basis, PrincipalBRDF
    from patina.core.brdf import metrics
    from patina.core.capture import read_capture
    from patina.core.job import FitJob

    print("## fit (in-basis: the embedded basis contains the material)\n")
    print(
        "| capture | BRDF | relative L2 | log RMS to 80 | cube-root RMS | "
        "fit / truth within 3 degrees of the half vector, theta_d 10, 40, 70 | "
        "held-out, typical pixel | held-out, relative RMS | s | MB |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name in ("bunny_bronze", "bunny_red", "bunny_fabric"):
        folder = data / "scans" / name
        truth = read_truth(folder / "truth.json")
        job = FitJob(read_capture(folder / "scan.capture.toml"))
        job.drain()
        if job.result is None:
            raise RuntimeError("the job ended without a result")
        material = job.result.materials[0]
        held = material.held_out
        if held is None:
            raise RuntimeError("eight photos and none held out")
        seconds = sum(stage.seconds for stage in job.stages)
        peak = job.stages[-1].peak_mb or float("nan")
        table = material.fit.brdf.table()
        fitted = f"{_figures(metrics.compare(table, truth))} | {_peak(table, truth)}"
        print(
            f"| {name} | the paper's fit | {fitted} | {100 * held.typical:.1f} % | "
            f"{100 * held.error:.1f} % | {seconds:.1f} | {peak:.0f} |"
        )
        angles = Angles(*(a[truth.valid] for a in merl_grid.node_angles(0.5)))
        rho = np.moveaxis(truth.values, 0, -1)[truth.valid]
        basis = Basis.default()
        best = PrincipalBRDF(basis, basis.project(rho, angles, COMPONENTS))
        table = best.table()
        projected = f"{_figures(metrics.compare(table, truth))} | {_peak(table, truth)}"
        print(f"| | truth on {COMPONENTS} components | {projected} | | | | |", flush=True)
    print()


def _peak(fit, truth) -> str:  # type: ignore[no-untyped-def]
    """Median ratio over cells with θh < 3° (ih < 16) and all φd in view, all channels."""
    ratios = []
    for theta_d in (10, 40, 70):
        place = (slice(None), slice(0, 16), theta_d, slice(None))
        seen = (fit.values[place] >= 0) & (truth.values[place] > 0)
        ratios.append(np.median(fit.values[place][seen] / truth.values[place][seen]))
    return ", ".join(f"{ratio:.2f}" for ratio in ratios)


def _figures(found) -> str:  # type: ignore[no-untyped-def]
    return f"{found.relative_l2:.3f} | {found.log_relative_rms:.3f} | {found.cube_root_rms:.4f}"
