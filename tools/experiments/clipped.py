"""Clipped highlights: fits that drop clipped samples, and fits that use them as lower limits."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from patina.core.angles import Angles
from patina.core.fit.measured import fit_measured
from patina.core.fit.measured_result import MeasuredResult
from patina.core.samples import SampleTable

from . import materials, metrics, scenes
from .estimators import OUR_COMPONENTS
from .runs import Records

SCENES = ("pebble-wavy", "bunny-openmvs")
SHARP = (
    "aurora_white_rgb", "bluebook", "blue-acrylic", "cc_blue_agat_rgb", "cc_iris_purple_gem_rgb",
    "chm_orange_rgb", "glossyredpaper", "irid_flake_paint1_rgb", "satin_purple_rgb",
    "vch_frozen_amethyst_rgb",
)  # fmt: skip
CLIPPED_SHARE = 1.5  # per cent of the samples
PEAK = np.radians(5.0)  # of θh


def tasks(quick: bool) -> list[tuple[str, str]]:
    """Return (scene, material) of each task."""
    if quick:
        return [(SCENES[0], SHARP[0])]
    return [(scene, name) for scene in SCENES for name in SHARP]


def work(task: tuple[str, str]) -> Records:
    """Return the records of one task."""
    scene, name = task
    (material,) = materials.materials([name])
    basis = materials.basis_for(material, OUR_COMPONENTS)
    table = scenes.sampled(scene).photograph(material.evaluate, 0)
    measured, clipped = clip(table)
    reference = metrics.Reference.of(material.evaluate)
    c = metrics.cells()
    peak = c.near & (c.angles.theta_h < PEAK) & (c.angles.theta_d < metrics.GRAZING)
    angles, truth = Angles(*(a[peak] for a in c.angles)), reference.values[peak]
    cases: tuple[tuple[str, SampleTable, SampleTable | None], ...] = (
        ("not clipped", table, None),
        ("clipped samples dropped", measured, None),
        ("clipped samples as lower limits", measured, clipped),
    )
    found: Records = []
    for kind, samples, limits in cases:
        result = MeasuredResult.of(fit_measured(samples, basis, clipped=limits))
        rho = np.asarray(result.brdf.evaluate(angles), np.float64)
        low, high = result.interval(angles)
        ratio = np.log((rho.sum(axis=1) + 1e-6) / (truth.sum(axis=1) + 1e-6))
        record: dict[str, Any] = {
            "scene": scene, "material": name, "estimator": kind, "seed": 0,
            **asdict(reference.errors(result.brdf.evaluate)),
            "peak": float(np.exp(ratio.mean())),
            "inside": float(np.mean((low <= truth) & (truth <= high))),
        }  # fmt: skip
        found.append(record)
    return found


def clip(table: SampleTable) -> tuple[SampleTable, SampleTable]:
    """Return (the samples that are not clipped, those that are, as lower limits) if the brightest
    CLIPPED_SHARE of all samples are clipped in their brightest channel."""
    white = np.float32(np.percentile(table.radiance.max(axis=1), 100 - CLIPPED_SHARE))
    limited = table.radiance >= white
    some = limited.any(axis=1)
    clipped = table.select(some)
    radiance = np.minimum(clipped.radiance, white)
    return table.select(~some), replace(
        clipped,
        radiance=radiance,
        rho=radiance / (clipped.irradiance * clipped.cos_i[:, None]),
        response=np.where(limited[some], 0, 1).astype(np.float32),
    )
