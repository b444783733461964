"""Run the paper's fit on captures with known truth; compare with the projected truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

COMPONENTS = 20
SEEDS = 5


def run(data: Path) -> None:
    """Print the table of docs/method/measurements.md, section "The paper's fit"."""
    from patina.commands.compare import read_truth
    from patina.core.angles import Angles, merl_grid
    from patina.core.basis import PrincipalBRDF, default_basis
    from patina.core.brdf import metrics
    from patina.core.capture import read_capture
    from patina.core.jobs import FitJob

    print(f"## fit (in-basis; median and range over {SEEDS} seeds)\n")
    print(
        "| capture | BRDF | relative L2 | log RMS to 80 | cube-root RMS | "
        "fit / truth within 3 degrees of the half vector, theta_d 10, 40, 70 | "
        "held-out, typical pixel | held-out, relative RMS | s | MB |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    basis = default_basis()
    for name in ("bunny_bronze", "bunny_red", "bunny_fabric"):
        folder = data / "scans" / name
        truth = read_truth(folder / "truth.json")
        capture = read_capture(folder / "scan.capture.toml")
        rows, peaks, held_out_errors = [], [], []
        for seed in range(SEEDS):
            paper = replace(capture.fit.paper, seed=seed)
            fit = replace(capture.fit, method="paper", paper=paper)
            job = FitJob(replace(capture, fit=fit))
            job.drain()
            if job.result is None or job.result.materials[0].held_out is None:
                raise RuntimeError("the job ended without a result")
            material = job.result.materials[0]
            table = material.fit.brdf.table()
            found = metrics.compare(table, truth)
            rows.append((found.relative_l2, found.log_relative_rms, found.cube_root_rms))
            peaks.append(_peak(table, truth))
            held_out_errors.append((100 * material.held_out.typical, 100 * material.held_out.error))
        seconds = sum(stage.seconds for stage in job.stages)
        peak = job.stages[-1].peak_mb or float("nan")
        print(
            f"| {name} | the paper's fit | {_spread(rows, '.3f')} | {_list(peaks)} | "
            f"{_spread(held_out_errors, '.1f', ' %')} | {seconds:.1f} | {peak:.0f} |"
        )
        angles = Angles(*(a[truth.valid] for a in merl_grid.node_angles(0.5)))
        rho = np.moveaxis(truth.values, 0, -1)[truth.valid]
        best = PrincipalBRDF(basis, basis.project(rho, angles, COMPONENTS)).table()
        found = metrics.compare(best, truth)
        figures = (found.relative_l2, found.log_relative_rms, found.cube_root_rms)
        projected = " | ".join(f"{x:.3f}" for x in figures)
        print(
            f"| | truth on {COMPONENTS} components | {projected} | "
            f"{_list([_peak(best, truth)])} | | | | |",
            flush=True,
        )
    print()


def _peak(fit, truth) -> list[float]:  # type: ignore[no-untyped-def]
    """Return the median ratio over visible cells with θh < 3° (ih < 16), all φd and channels."""
    ratios = []
    for theta_d in (10, 40, 70):
        place = (slice(None), slice(0, 16), theta_d, slice(None))
        seen = (fit.values[place] >= 0) & (truth.values[place] > 0)
        ratios.append(float(np.median(fit.values[place][seen] / truth.values[place][seen])))
    return ratios


def _list(rows: list[list[float]]) -> str:
    return ", ".join(f"{x:.2f}" for x in np.median(rows, axis=0))


def _spread(rows: list[tuple[float, ...]], form: str, unit: str = "") -> str:
    """Format the median (smallest … largest) of every column as table cells."""
    columns = np.array(rows).T
    return " | ".join(
        f"{np.median(c):{form}}{unit} ({c.min():{form}} … {c.max():{form}})" for c in columns
    )
