"""The report of a fit: one HTML page and its pictures, in one folder, no network needed."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path
from urllib.parse import quote

import numpy as np

from ..geometry import view_surface
from ..job import CaptureResult, MaterialResult, inputs
from ..photo import write_png
from ..predict.compose import predict_photo
from . import display
from .polar import Curve, polar_chart
from .sphere import lit_sphere

STYLE = Path(__file__).parents[2] / "assets" / "report" / "style.css"
LONGEST = 640


def write_report(folder: Path, result: CaptureResult) -> Iterator[float]:
    """Write index.html and pictures into ``folder``; yields the fraction done before each piece."""
    folder.mkdir(parents=True, exist_ok=True)
    body: list[str] = []
    count = len(result.materials) + len(result.capture.photos)
    for done, material in enumerate(result.materials):
        yield done / count
        body.append(_material_section(folder, material))
    body.append(
        "<h2>Photo, prediction, difference</h2><p class='sub'>Each prediction is made from the "
        "scanned mesh, the light and the fitted materials: direct light and cast shadows. "
        "Difference: <span class='key'></span> prediction too dark … too bright, full colour at "
        "± 30 % of the photo's white. Dark grey: no surface or no material.</p>"
    )
    for place in range(len(result.capture.photos)):
        yield (len(result.materials) + place) / count
        body.append(_photo_row(folder, result, place))
    title = escape(result.capture.file.name)
    (folder / "index.html").write_text(
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>Patina: {title}</title>"
        f"<style>{STYLE.read_text('utf-8')}</style><h1>Patina report</h1><p class='sub'>{title} · "
        f"{len(result.capture.photos)} lit photos · {len(result.scan.mesh.faces):,} faces · basis "
        f"{result.basis.version}</p>{''.join(body)}</html>",
        "utf-8",
    )


def _material_section(folder: Path, material: MaterialResult) -> str:
    brdf = material.fit.brdf
    sphere, coverage = lit_sphere(brdf.evaluate)
    picture = display.srgb(sphere)
    alpha = (coverage * 255 + 0.5).astype(np.uint8)
    name = f"sphere_{material.name}.png"
    write_png(folder / name, np.dstack([picture, alpha]))
    charts = "".join(
        f"<figure>{polar_chart([Curve('fit', brdf.evaluate)], incidence)}</figure>"
        for incidence in (15, 45, 70)
    )
    warnings = "".join(f"<p class='warn'>{escape(w)}</p>" for w in material.warnings)
    rows = "".join(f"<tr><th>{key}</th><td>{value}</td></tr>" for key, value in _figures(material))
    return (
        f"<h2>{escape(material.name)}</h2><div class='material'><figure>"
        f"<img src='{escape(quote(name))}' alt='lit sphere'>"
        f"<figcaption>Lit sphere, key light π at the upper left</figcaption>"
        f"</figure><div>{warnings}<table>{rows}</table></div></div>"
        f"<div class='charts'>{charts}</div>"
    )


def _figures(material: MaterialResult) -> list[tuple[str, str]]:
    fit, p, spread = material.fit, material.principled.principled, material.spread
    held = material.held_out
    unseen = (
        "nothing could be held out: too few photos see it, or it was switched off"
        if held is None
        else f"predicts the typical pixel of an unseen photo to {100 * held.typical:.0f} %; "
        f"{100 * held.error:.0f} % relative RMS, which highlights dominate"
    )
    colour = ", ".join(f"{c:.3f}" for c in p.base_color)
    return [
        ("held-out photos", unseen),
        (
            "samples",
            f"{material.samples:,} lit pixels, {fit.reliable:,} on calm surface, "
            f"{len(fit.chosen)} chosen (condition number {fit.condition:.1f})",
        ),
        (
            "cosine similarity",
            f"{fit.similarity.max():.4f}, the best of {len(fit.similarity)} trials "
            f"(worst {fit.similarity.min():.4f})",
        ),
        (
            "spread of trials",
            f"± {100 * spread.median:.0f} % median, "
            f"± {100 * spread.at_highlight:.0f} % at the highlight",
        ),
        (
            "Principled",
            f"base colour {colour} · metallic {p.metallic:.2f} · roughness {p.roughness:.2f} · "
            f"specular {p.specular_ior_level:.2f} · coat {p.coat_weight:.2f} "
            f"(cube-root error {100 * material.principled.error:.1f} %)",
        ),
    ]


def _photo_row(folder: Path, result: CaptureResult, place: int) -> str:
    capture = result.capture
    camera = inputs.camera_of(capture, result.scan, place)
    view = view_surface(result.rays, camera)
    where, _ = inputs.material_pixels(capture, result.scan, view, place)
    parts = [(where[m.name], m.fit.brdf, m.scale) for m in result.materials]
    light = result.lights.of(capture, place)
    predicted = predict_photo(result.rays, view, light, camera, parts)
    measured = result.photos.read(place).radiance
    box = display.crop_box(view.seen, margin=12)
    a = display.shrink(measured[box], LONGEST)
    b = display.shrink(predicted.radiance[box], LONGEST)
    white = display.white_level(measured[box][view.seen[box]])
    names = [f"photo_{place:02d}_{kind}.png" for kind in ("measured", "predicted", "difference")]
    write_png(folder / names[0], display.photo_picture(a, white))
    write_png(folder / names[1], display.photo_picture(b, white))
    write_png(folder / names[2], display.difference_picture(b, a, 0.3 * white))
    error = _relative_error(predicted.radiance, measured)
    labels = (
        f"{escape(capture.photo_name(place))}: photo",
        "prediction",
        f"difference, relative RMS {100 * error:.1f} %",
    )
    cells = "".join(
        f"<figure><img src='{name}' alt='{label}' loading='lazy'><figcaption>{label}</figcaption>"
        "</figure>"
        for name, label in zip(names, labels, strict=True)
    )
    return f"<div class='triple'>{cells}</div>"


def _relative_error(predicted: np.ndarray, measured: np.ndarray) -> float:
    """‖L̂ − L‖ / ‖L‖ over all pixels with a prediction, edges and shadows included."""
    known = np.isfinite(predicted[..., 0])
    difference = (predicted - measured)[known].astype(np.float64)
    size = float(np.linalg.norm(measured[known].astype(np.float64)))
    return float(np.linalg.norm(difference)) / max(size, 1e-300)
