"""Sweeps that the paper does not report: one setting or condition is changed at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

from patina.core.errors import FitError

from . import bunnies, estimators, materials, metrics, scenes
from .runs import Records
from .simulate import Sampled, sample_scanned

SAMPLES = (5, 6, 8, 12, 20, 32)
CURVATURES = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, float("inf"))
PHOTOS = (1, 2, 4, 8, 16)
DEGREES = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
TOOLS = ("true mesh", *bunnies.BUNNIES)
SEEDS = 2
MATERIALS = ("alum-bronze", "blue-acrylic", "pink-fabric", "green-latex")
COMPARED = ("paper", "all samples k=20", "ours")


def tasks(quick: bool) -> list[tuple[str, str, bool]]:
    """Return (sweep, scene or shape, quick) of each task."""
    if quick:
        return [("samples", "pebble-wavy", True), ("mesh error, bumpy", "pebble", True)]
    return [
        ("mesh error, bumpy", "jar", False),
        ("mesh error, blurred", "jar", False),
        ("stereo tool", "bunny", False),
        ("samples", "bunny-openmvs", False),
        ("samples", "knot-blurred", False),
        ("curvature", "bunny-openmvs", False),
        ("curvature", "knot-blurred", False),
        ("photos", "knot-blurred", False),
        ("photos", "pebble-wavy", False),
    ]


def work(task: tuple[str, str, bool]) -> Records:
    """Return one record per value, material, estimator and seed."""
    sweep, where, quick = task
    names = ("alum-bronze", "pink-fabric") if quick else MATERIALS
    found: Records = []
    for label, value, taken, row in _cases(sweep, where, quick):
        if not estimators.is_selected(row.name):
            continue
        for material in materials.materials(names):
            reference = metrics.Reference.of(material.evaluate)
            basis = materials.basis_for(material, row.components)
            light = taken.true.transport(material.evaluate)
            for seed in range(1 if quick or not row.random else SEEDS):
                table = taken.exposed(light, seed)
                base = {
                    "sweep": sweep, "where": where, "value": value, "label": label,
                    "material": material.name, "estimator": row.name, "seed": seed,
                }  # fmt: skip
                try:
                    fit = row.estimator(table, basis, seed)
                except FitError as error:
                    found.append({**base, "failed": str(error)})
                    continue
                found.append({**base, **asdict(reference.errors(fit.evaluate))})
    return found


def _cases(
    sweep: str, where: str, quick: bool
) -> Iterator[tuple[str, float, Sampled, estimators.Row]]:
    rows = [r for name, r in estimators.rows().items() if name in COMPARED]
    if sweep == "samples":
        yield from _samples(scenes.sampled(where), SAMPLES[:2] if quick else SAMPLES)
    elif sweep == "curvature":
        for threshold in CURVATURES:
            setting = None if threshold == float("inf") else threshold
            row = estimators.Row("paper", estimators.paper_with(curvature=setting))
            label = "none" if setting is None else f"{threshold:g}"
            yield label, threshold, scenes.sampled(where), row
    elif sweep == "photos":
        whole = scenes.scene(where).sampled(max(PHOTOS))
        for count in PHOTOS:
            for row in rows:
                yield str(count), count, whole.first_photos(count), row
    elif sweep.startswith("mesh error"):
        kind = sweep.split(", ")[1]
        for degrees in DEGREES[3:4] if quick else DEGREES:
            scene = scenes.own_scene(where, kind, max(degrees, 0.5))
            taken = scene.sampled() if degrees else scene.oracle()
            for row in rows:
                yield f"{degrees:g}", degrees, taken, row
    elif sweep == "stereo tool":
        shots = bunnies.opened("OpenMVS")[2]
        for place, tool in enumerate(TOOLS):
            true = bunnies.true_bunny()
            scanned = true if tool == "true mesh" else bunnies.opened(tool)[1].mesh
            taken = sample_scanned(true, scanned, shots)
            for row in rows:
                yield tool, place, taken, row


def _samples(
    taken: Sampled, counts: tuple[int, ...]
) -> Iterator[tuple[str, float, Sampled, estimators.Row]]:
    for count in counts:
        row = estimators.Row("paper", estimators.paper_with(samples=count))
        yield str(count), count, taken, row
    everything = float(len(taken.table))
    for k in (6, 20, 40):
        row = estimators.Row(f"all samples k={k}", estimators.all_samples(k), random=False)
        yield "all", everything, taken, row
    for name, row in estimators.rows().items():
        if name == "ours":
            yield "all", everything, taken, row
