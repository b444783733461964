"""`run.py hunt --evidence`: what one step of every effect gains on the baseline.

The evidence by which the diagnosis judges an effect (core/diagnose/selection/evidence.py), and the
same for held-out photos and parts of the surface. Gains are in thousandths of a nat a pixel and
channel, in brackets their ratio to the standard error. At the end: the largest gain of each effect
over all captures. Captures are given, or made as by `--field`.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..package import load_patina

PARTS = 6  # of the surface, across


Gains = dict[str, tuple[float, float]]
"""Cause → (gain, its ratio to the standard error) on held-out regions."""


def main(words: Sequence[str]) -> int:
    """Fit each capture, and print its table."""
    load_patina()
    parser = argparse.ArgumentParser(prog="run.py hunt --evidence", description=__doc__)
    parser.add_argument("captures", nargs="*", type=Path, metavar="CAPTURE")
    parser.add_argument("--hidden", nargs="+", default=[], metavar="CAUSE")
    parser.add_argument("--strength", type=float, default=0.03)
    parser.add_argument("--seeds", nargs="+", type=int, default=[0])
    given = parser.parse_args(words)
    found = [_print(path, str(path)) for path in given.captures]
    found += [
        _print_made(cause, given.strength, seed) for cause in given.hidden for seed in given.seeds
    ]
    _print_largest(found)
    return 0


def _print_made(cause: str, strength: float, seed: int) -> Gains:
    """A simulated capture. cause: "none", or what is hidden in it."""
    from .make import CAPTURE, make

    with tempfile.TemporaryDirectory() as folder:
        truth = make(Path(folder), cause, 0.0 if cause == "none" else strength, seed)
        title = f"{cause}, seed {seed}, {truth.scan}, {truth.material}, {truth.lamp}"
        return _print(Path(folder) / CAPTURE, title)


def _print_largest(found: Sequence[Gains]) -> None:
    causes = sorted({cause for gains in found for cause in gains})
    print("\n| effect | largest gain | captures |\n|---|---|---|")
    for cause in causes:
        every = [gains[cause] for gains in found if cause in gains]
        gain, ratio = max(every)
        print(f"| {cause} | {gain:.1f} ({ratio:.1f}) | {len(every)} |")


def _print(path: Path, title: str) -> Gains:
    from patina.core.capture import read_capture
    from patina.core.concurrency.steps import drained
    from patina.core.diagnose.effects import effects_for
    from patina.core.diagnose.effects.base.surface_patches import surface_patches
    from patina.core.diagnose.nuisances.surface_variation import WAYS
    from patina.core.diagnose.selection.baseline import fit_baseline
    from patina.core.diagnose.selection.cross_validation import standard_error_of_sum
    from patina.core.diagnose.selection.evidence import evidence_for, has_one_step
    from patina.core.diagnose.selection.one_step import ProjectedBaseline
    from patina.core.jobs import FitJob
    from patina.core.jobs.diagnose_job import context_of, normal_deviation
    from patina.core.jobs.varying.node_steps import CHOICE_NODES
    from patina.core.jobs.varying.surface_observations import observe_surface
    from patina.core.jobs.varying.variation_for_diagnosis import variation_for_diagnosis

    job = FitJob(read_capture(path), portable=False)
    job.keep = True
    job.drain()
    assert job.result is not None
    surface = drained(observe_surface(job.result, CHOICE_NODES, 0.0, 0.3))
    variation = drained(variation_for_diagnosis(job.result, surface, 0.3, 0.7))
    context = drained(context_of(job.result, None, variation))
    baseline = fit_baseline(context, np.radians(normal_deviation(job.result)))
    projected = ProjectedBaseline.of(baseline.fitted)
    count = baseline.fitted.residual.size
    print(f"\n{title}\n")
    if baseline.scales is not None:
        scales = (f"{w} {s:.4f}" for w, s in zip(WAYS, baseline.scales, strict=True))
        print(f"scales of the surface: {', '.join(scales)}\n")
    print("| effect | gain | held-out regions | photos | parts of the surface | RMS change |")
    print("|---|---|---|---|---|---|")
    groups = context.pixels.block, context.pixels.photo, surface_patches(context, PARTS)
    effects = [effect for effect in effects_for(context) if has_one_step(effect)]
    gained: Gains = {}
    for one in evidence_for(projected, effects):
        step, cells = one.step, []
        gained[one.cause] = 1e3 * one.trial.density, one.trial.ratio
        for group in groups:
            gains = step.held_out(group)
            error = max(standard_error_of_sum(gains), 1e-9)
            cells.append(f"{1e3 * gains.sum() / count:.2f} ({gains.sum() / error:.1f})")
        print(
            f"| {step.effect.cause} | {1e3 * step.gain / count:.2f} | {' | '.join(cells)} | "
            f"{100 * step.change:.2f} % |",
            flush=True,
        )
    return gained
