"""Errors of the portable models (Principled, lobe stack, OpenPBR, glTF and UsdPreviewSurface),
compared with the table on spheres.

Every material is fitted like the result of a capture, but from its true BRDF, so that the errors
are those of the model alone. Pictures are rendered under Blender's HDR worlds (sphere_light.py).
The measure is the PSNR of the 8-bit sRGB values of the disc's pixels, with white at the 95th
percentile of the true picture; a material has the median over the worlds.
"""

from __future__ import annotations

import time
from functools import partial

import numpy as np

from patina.core.appearance.lobe_fit import fit_lobe_stack
from patina.core.appearance.open_pbr.fit import fit_open_pbr, from_principled
from patina.core.appearance.principled import Principled
from patina.core.appearance.principled_fit import fit_principled
from patina.core.export.gltf_model import GLTF
from patina.core.export.preview_surface import PREVIEW_SURFACE
from patina.core.photo import write_png
from patina.core.views.display import srgb

from ..common import ROOT
from . import free_principled, free_sum, materials, spheres
from .records import Record, table
from .runs import Records
from .sphere_light import At, lit

IMAGES = "images/appearance"
LARGE = 64  # diameter in pixels, in the pictures of the worst materials
SHOWN = ("city", "studio", "sunset")  # worlds in these pictures
WORST = 5
BACKGROUND = 246  # 8-bit grey level behind the spheres
MODELS = {
    "principled": "Principled",
    "free_principled": "Principled, every input (bound)",
    "plain": "lobe stack, plain",
    "lobes": "lobe stack",
    "free": "any sum of closures (bound)",
    "open_pbr": "OpenPBR",
    "gltf": "glTF",
    "preview": "UsdPreviewSurface",
    "lambertian": "best Lambertian",
}
BY_MATERIAL = ("principled", "lobes", "free", "open_pbr", "gltf", "preview", "lambertian")
METRIC = ("principled", "plain", "lobes", "open_pbr", "gltf", "preview", "lambertian")
"""The models with a cube-root error; the bounds have pictures only."""
TRANSLATED = {"open_pbr": "open_pbr_values", "gltf": "gltf_values", "preview": "preview_values"}
"""Model → the same with the values of the Principled."""
GOALS = {"principled": 38.0, "lobes": 42.0}  # dB, median over the materials


def tasks(quick: bool) -> list[str]:
    """Return the names of the validation materials."""
    names = [m.name for m in materials.materials() if not m.trained]
    return names[:2] if quick else names


def work(name: str) -> Records:
    """Return a record with cube-root error, PSNR per world and processor time of every model."""
    (material,) = materials.materials([name])
    start = time.process_time()
    principled = fit_principled(material.evaluate)
    between = time.process_time()
    lobes = fit_lobe_stack(material.evaluate)
    ended = time.process_time()
    fitted = principled.principled
    open_pbr = fit_open_pbr(material.evaluate, fitted)
    gltf, preview = (
        fit_principled(material.evaluate, shown=shown) for shown in (GLTF, PREVIEW_SURFACE)
    )
    grey = Principled(base_color=principled.lambertian, specular_ior_level=0.0)
    models: dict[str, tuple[At, float | None]] = {
        "principled": (fitted.at, principled.error),
        "plain": (lobes.plain.at, lobes.plain_error),
        "lobes": (lobes.stack.at, lobes.error),
        "open_pbr": (open_pbr.surface.at, open_pbr.error),
        "open_pbr_values": (from_principled(fitted).at, None),
        "gltf": (partial(GLTF.at, gltf.principled), gltf.error),
        "gltf_values": (partial(GLTF.at, fitted), None),
        "preview": (partial(PREVIEW_SURFACE.at, preview.principled), preview.error),
        "preview_values": (partial(PREVIEW_SURFACE.at, fitted), None),
        "lambertian": (grey.at, principled.diffuse_error),
    }
    truth = lit().table(material.evaluate)
    found = {
        key: {"error": error, "psnr": spheres.psnr(lit().model(at), truth).tolist()}
        for key, (at, error) in models.items()
    }
    bounds = {
        "free": free_sum.best_pictures(truth),
        "free_principled": free_principled.best_pictures(truth, fitted),
    }
    for key, pictures in bounds.items():
        found[key] = {"error": None, "psnr": spheres.psnr(pictures, truth).tolist()}
    return [
        {
            "material": name,
            "worlds": list(spheres.worlds()),
            **found,
            "lobe_count": len(lobes.stack.lobes),
            "seconds": {"principled": between - start, "lobes": ended - between},
        }
    ]


def summary(records: list[Record]) -> str:
    """Return a table of medians and goals."""
    rows = []
    for key, label in MODELS.items():
        levels = [_level(r, key) for r in records]
        errors = [r[key]["error"] for r in records]
        goal = f"≥ {GOALS[key]:.0f} dB" if key in GOALS else "–"
        reached = sum(level >= GOALS.get(key, 0) for level in levels) if key in GOALS else None
        rows.append(
            [
                label,
                f"{np.median(levels):.1f} dB",
                goal,
                "–" if reached is None else f"{reached} of {len(records)}",
                f"{min(levels):.1f} … {max(levels):.1f} dB",
                f"{100 * np.median(errors):.1f} %" if key in METRIC else "–",
            ]
        )
        if key in TRANSLATED:
            values = [_level(r, TRANSLATED[key]) for r in records]
            rows.append(
                [
                    f"{label}, values of the Principled",
                    f"{np.median(values):.1f} dB",
                    "–",
                    "–",
                    f"{min(values):.1f} … {max(values):.1f} dB",
                    "–",
                ]
            )
    head = ["model", "median PSNR", "goal", "materials that reach the goal", "range"]
    seconds = [np.median([r["seconds"][key] for r in records]) for key in ("principled", "lobes")]
    return (
        table([*head, "median cube-root error"], rows)
        + f"\nProcessor time of a fit, median: Principled {seconds[0]:.1f} s, lobe stack "
        f"{seconds[1]:.1f} s.\n"
    )


def by_material(records: list[Record]) -> str:
    """Return a table with one row per material, in descending order of the lobe stack's PSNR."""
    rows = []
    for r in sorted(records, key=lambda r: -_level(r, "lobes")):
        rows.append(
            [r["material"]]
            + [f"{_level(r, key):.1f}" for key in BY_MATERIAL]
            + [f"{100 * r[key]['error']:.1f}" for key in BY_MATERIAL if key in METRIC]
            + [str(r["lobe_count"])]
        )
    head = ["material", *(f"{MODELS[key]}, dB" for key in BY_MATERIAL)]
    errors = (f"{MODELS[key]}, %" for key in BY_MATERIAL if key in METRIC)
    return table([*head, *errors, "lobes"], rows)


def worst(records: list[Record]) -> str:
    """Return the five materials with the lowest PSNR of the lobe stack, each with a picture."""
    folder = ROOT / "docs" / IMAGES
    folder.mkdir(parents=True, exist_ok=True)
    parts = []
    for r in sorted(records, key=lambda r: _level(r, "lobes"))[:WORST]:
        name = r["material"]
        write_png(folder / f"{name}.png", _picture(name))
        parts.append(
            f"**{name}**: lobe stack {_level(r, 'lobes'):.1f} dB, Principled "
            f"{_level(r, 'principled'):.1f} dB\n\n![{name}: table, lobe stack, Principled under "
            f"{', '.join(SHOWN)}](../{IMAGES}/{name}.png)"
        )
    return "\n\n".join(parts)


def _level(record: Record, key: str) -> float:
    return float(np.median(record[key]["psnr"]))


def _picture(name: str) -> np.ndarray:
    """Render (LARGE, 9·LARGE, 3): table, lobe stack and Principled under each world in SHOWN."""
    (material,) = materials.materials([name])
    lobes, principled = fit_lobe_stack(material.evaluate), fit_principled(material.evaluate)
    spheres_shown = []
    for world in SHOWN:
        light = lit(LARGE, world)
        truth = light.table(material.evaluate)[0]
        white = max(float(np.percentile(truth, spheres.WHITE)), 1e-9)
        models = [light.model(model.at)[0] for model in (lobes.stack, principled.principled)]
        for radiance in (truth, *models):
            picture = np.full((LARGE, LARGE, 3), BACKGROUND, np.uint8)
            picture[light.inside] = srgb(radiance / white)
            spheres_shown.append(picture)
    return np.concatenate(spheres_shown, axis=1)
