"""Figure 10 of Ono et al. 2019: ablation of the paper's assumptions; data for Figures 9 and 11."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from patina.core.basis import PrincipalBRDF
from patina.core.fit import PaperSettings, fit_paper
from patina.core.views.polar import slice_angles

from . import estimators, materials, metrics, scenes
from .runs import Records

RUNS = 20
VARIANTS: dict[str, dict[str, Any]] = {
    "none": {"curvature": None, "monotonicity": False, "highest_intensity": False},
    "curvature": {"monotonicity": False, "highest_intensity": False},
    "monotonicity": {"curvature": None, "highest_intensity": False},
    "highest intensity": {"curvature": None, "monotonicity": False},
    "all": {},
}
"""Bar of the paper's figure → changed settings; "none" is Nielsen's method on random pixels."""

SCENES = ("bunny-openmvs", "knot-blurred")
INCIDENCE = 45.0
"""Degrees from the normal. 135° in the paper, which counts along the half-circle."""
CANDIDATE_RUNS = 4  # runs of "all" whose candidates are all evaluated (Figure 11)


def tasks(quick: bool) -> list[tuple[str, str, int]]:
    """Return (scene, material, runs) of each task."""
    some = ("pebble-wavy",) if quick else SCENES
    names = ("alum-bronze", "pink-fabric") if quick else materials.PAPER
    return [(scene, name, 2 if quick else RUNS) for scene in some for name in names]


def work(task: tuple[str, str, int]) -> Records:
    """Return records of runs and variants (with the candidates for "all"), and of slices."""
    scene, name, runs = task
    material = materials.materials([name])[0]
    taken = scenes.sampled(scene)
    reference = metrics.Reference.of(material.evaluate)
    basis = materials.basis_for(material)
    found: Records = []
    slices: dict[str, Any] = {"truth": _slice(material.evaluate)}
    runs = runs if estimators.is_selected("paper") else 1
    light = taken.true.transport(material.evaluate)
    for seed in range(runs):
        table = taken.exposed(light, seed)
        for variant, changes in VARIANTS.items() if estimators.is_selected("paper") else ():
            fit = fit_paper(table, basis, PaperSettings(seed=seed, **changes))
            record = {
                "scene": scene, "material": name, "estimator": "paper", "variant": variant,
                "seed": seed,
                "condition": fit.condition, "warnings": len(fit.warnings),
                **asdict(reference.errors(fit.brdf.evaluate)),
            }  # fmt: skip
            if variant == "all" and seed < CANDIDATE_RUNS:
                record["candidates"] = [
                    {
                        "similarity": float(similarity),
                        **asdict(reference.errors(PrincipalBRDF(basis, c).evaluate)),
                    }
                    for c, similarity in zip(fit.candidates, fit.similarity, strict=True)
                ]
            if seed == 0 and variant in ("none", "all"):
                slices[variant] = _slice(fit.brdf.evaluate)
            found.append(record)
        if seed == 0 and "ours" in estimators.rows():
            row = estimators.rows()["ours"]
            own = materials.basis_for(material, row.components)
            slices["ours"] = _slice(row.estimator(table, own, seed).evaluate)
    found += [
        {"scene": scene, "material": name, "estimator": _owner(kind), "kind": kind, "slice": values}
        for kind, values in slices.items()
    ]
    return found


def _owner(kind: str) -> str:
    """Return the estimator that computes a slice."""
    return {"ours": "ours", "truth": "truth"}.get(kind, "paper")


def _slice(evaluate: metrics.Evaluate) -> list[list[float]]:
    values = np.asarray(evaluate(slice_angles(np.radians(INCIDENCE))[1]))
    return [[float(f"{x:.5g}") for x in row] for row in values]
