"""Run every estimator on every material and scene; the records of the table of goals."""

from __future__ import annotations

import time
from dataclasses import asdict
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from patina.core.basis import Basis
from patina.core.fit import PaperSettings
from patina.core.fit.held_out import fit_without_photo, photos_to_hold_out, summarise
from patina.core.samples import SampleTable

from . import estimators, materials, metrics, scenes, spheres
from .runs import Records

SEEDS = 3
IN_BASIS = ("paper", "ours")
PICTURES = ("paper", "ours", "ours, true mesh", estimators.MERL_PRIOR)
ORACLES = ("jar-bumpy", "pebble-wavy")
"""Scenes in which Patina's estimator, the slowest one, is also run with the true mesh."""
SOME = (
    *materials.PAPER, "aurora_white_rgb", "cm_military_green_rgb", "ilm_l3_37_metallic_rgb",
    "leaf_maple_rgb", "paper_blue_rgb", "satin_purple_rgb",
)  # fmt: skip
"""Materials of the scenes with scripted shapes; the reconstructed bunnies use all materials."""
FLOORS = (5, 20, 40, 100)


def tasks(quick: bool) -> list[tuple[str, list[str], int]]:
    """Return (scene or "floors", materials, seeds) of each task, the longest first."""
    names = [m.name for m in materials.materials()]
    if quick:
        names = ["pink-fabric2", "paper_blue_rgb"]
    some = ["pebble-wavy"] if quick else list(scenes.SCENES)
    found: list[tuple[str, list[str], int]] = []
    for scene in some:
        if quick or not scene.startswith("bunny"):
            found.append((scene, names if quick else list(SOME), 1 if quick else SEEDS))
        else:
            half = len(names) // 2
            found += [(scene, part, SEEDS) for part in (names[:half], names[half:])]
    return [("floors", names, 1), *found]


def work(task: tuple[str, list[str], int]) -> Records:
    """Return the records of one task."""
    scene, names, seeds = task
    if scene == "floors":
        return floors(names) if estimators.is_selected("floors") else []
    found: Records = []
    taken, oracle = scenes.sampled(scene), scenes.sampled(scene, "oracle")
    elsewhere = scenes.sampled(scene, "elsewhere")
    seen = metrics.covered(taken.table)
    for material in materials.materials(names):
        reference = metrics.Reference.of(material.evaluate)
        new_photos = elsewhere.photograph(material.evaluate, None)
        light = {False: taken.true.transport(material.evaluate)}
        light[True] = oracle.true.transport(material.evaluate)
        for row in estimators.rows().values():
            for in_basis in (False, True):
                if in_basis and not (material.trained and row.name in IN_BASIS):
                    continue
                basis = materials.basis_for(material, row.components, in_basis, row.merl_prior)
                if row.true_mesh and row.components > 40 and scene not in ORACLES:
                    continue
                for seed in range(seeds if row.random and not in_basis else 1):
                    capture = oracle if row.true_mesh else taken
                    table = capture.exposed(light[row.true_mesh], seed)
                    start = time.perf_counter()
                    fit = row.estimator(table, basis, seed)
                    seconds = time.perf_counter() - start
                    record: dict[str, Any] = {
                        "scene": scene, "material": material.name, "estimator": row.name,
                        "in_basis": in_basis, "seed": seed, "seconds": seconds,
                        "coverage": float(seen.mean()),
                        **asdict(reference.errors(fit.evaluate, seen)),
                    }  # fmt: skip
                    record |= band_coverage(fit, reference, seen)
                    if not row.true_mesh and not in_basis and seed == 0:
                        record |= image_errors(fit, table, new_photos, basis, row.name)
                    if (
                        not in_basis
                        and seed == 0
                        and not material.trained
                        and (row.name in PICTURES)
                    ):
                        record |= picture_errors(fit, material.name)
                    found.append(record)
    return found


def picture_errors(fit: estimators.Fitted, name: str) -> dict[str, list[float]]:
    """Return PSNR and, where it is installed, FLIP of a sphere under every world."""
    pictures, truth = spheres.pictures(fit.evaluate), true_pictures(name)
    flip = spheres.flip(pictures, truth)
    psnr = spheres.psnr(pictures, truth).tolist()
    return {"psnr": psnr} if flip is None else {"psnr": psnr, "flip": flip.tolist()}


def image_errors(
    fit: estimators.Fitted, table: SampleTable, new_photos: SampleTable, basis: Basis, name: str
) -> dict[str, float]:
    """Return the reported error on held-out photos, and the true error on photos of new views and
    lights without noise, both with the scanned mesh: relative RMS and typical pixel."""
    rho = np.asarray(fit.evaluate(new_photos.angles))
    predicted = rho * new_photos.irradiance * new_photos.cos_i[:, None]
    rms, typical = metrics.image_error(predicted, new_photos.radiance)
    out = {"image_rms": rms, "image_typical": typical}
    if name == "paper":
        parts = [
            fit_without_photo(table, photo, basis, PaperSettings())
            for photo in photos_to_hold_out(table)
        ]
        summary = summarise([part for part in parts if part is not None])
    else:
        summary = estimators.reported(fit)
    if summary is not None:
        out |= {"held_out_rms": summary.error, "held_out_typical": summary.typical}
    return out


def band_coverage(
    fit: estimators.Fitted, reference: metrics.Reference, seen: NDArray[np.bool_]
) -> dict[str, float]:
    """Return the fraction of cells whose true value is inside the 90 % interval (all channels,
    light and view within 80°), for cells with and without samples and for those with θd beyond
    metrics.GRAZING. Empty without an interval."""
    interval = estimators.interval(fit)
    if interval is None:
        return {}
    cells = metrics.cells(reference.every)
    low, high = interval(cells.angles)
    inside = (reference.values >= low) & (reference.values <= high)
    return {
        "band_seen": float(inside[cells.near & seen].mean()),
        "band_unseen": float(inside[cells.near & ~seen].mean()),
        "band_grazing": float(inside[cells.near & (cells.angles.theta_d > metrics.GRAZING)].mean()),
    }


def floors(names: list[str]) -> Records:
    """Project the truth on the components of a basis: the lowest error that a fit can reach."""
    found: Records = []
    for material in materials.materials(names):
        reference = metrics.Reference.of(material.evaluate)
        for in_basis in (False, True) if material.trained else (False,):
            for count in FLOORS:
                basis = materials.basis_for(material, count, in_basis)
                best = reference.projected(basis, count)
                record = {
                    "scene": "floor", "material": material.name, "estimator": f"floor k={count}",
                    "in_basis": in_basis, "seed": 0, **asdict(reference.errors(best.evaluate)),
                }  # fmt: skip
                if not material.trained and count >= 40:
                    record["psnr"] = spheres.psnr(
                        spheres.pictures(best.evaluate), true_pictures(material.name)
                    ).tolist()
                found.append(record)
    return found


@lru_cache(maxsize=40)
def true_pictures(name: str) -> NDArray[np.float32]:
    """Return pictures of a sphere of the material under every world."""
    return spheres.pictures(materials.materials([name])[0].evaluate)
