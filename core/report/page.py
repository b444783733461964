"""The report of a fit: one HTML page and its pictures, in one folder, no network needed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

import numpy as np

from ..fit.measured_result import MeasuredResult
from ..geometry import PixelRays, bands, view_window
from ..job import CaptureResult, MaterialResult, inputs
from ..photo import write_png
from ..predict.compose import predict_photo
from ..views.polar import NEAR_PLANE, polar
from ..views.subject import Subject
from ..views.svg import svg
from . import display
from .figures import figures
from .sphere import Reflector, write_sphere

STYLE = Path(__file__).parents[2] / "assets" / "report" / "style.css"
LONGEST = 640
ROWS = 256  # of a photo at a time


def write_report(folder: Path, result: CaptureResult) -> Iterator[float]:
    """Write index.html and pictures into ``folder``; yields the fraction done before each piece."""
    folder.mkdir(parents=True, exist_ok=True)
    body = [f"<p>Taken into account: {escape(e.sentence)}.</p>" for e in result.effects]
    photos = [result.capture.photo_name(place) for place in range(len(result.capture.photos))]
    count = len(result.materials) + len(result.capture.photos)
    for done, material in enumerate(result.materials):
        yield done / count
        body.append(_material_section(folder, material, photos))
    if not result.effects:  # these predictions know the capture's own light and camera only
        yield from _photo_rows(folder, result, body)
    head = (
        f"{len(result.capture.photos)} lit photos · {len(result.scan.mesh.faces):,} faces · basis "
        f"{result.basis.version}"
    )
    html = page(result.capture.file.name, "".join(body), head)
    (folder / "index.html").write_text(html, "utf-8")


def page(name: str, body: str, head: str = "") -> str:
    """A whole page about a capture; body: HTML; head: text below the title."""
    title = escape(name)
    told = title if not head else f"{title} · {escape(head)}"
    return (
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>Patina: {title}</title>"
        f"<style>{STYLE.read_text('utf-8')}</style><h1>Patina report</h1><p class='sub'>{told}</p>"
        f"{body}</html>"
    )


def _material_section(folder: Path, material: MaterialResult, photos: Sequence[str]) -> str:
    fit, brdf = material.fit, material.fit.brdf
    interval = fit.interval if isinstance(fit, MeasuredResult) else None
    spheres = _spheres(folder, material)
    subject = Subject("fit", brdf.evaluate, interval, material.points)
    charts = "".join(
        f"<figure>{svg(polar([subject], incidence))}</figure>" for incidence in (15, 45, 70)
    )
    warnings = "".join(f"<p class='warn'>{escape(w)}</p>" for w in material.warnings)
    rows = "".join(
        f"<tr><th>{escape(key)}</th><td>{escape(value)}</td></tr>"
        for key, value in figures(material, photos)
    )
    shaded = "" if interval is None else "; shaded: the 90 % interval"
    return (
        f"<h2>{escape(material.name)}</h2>{warnings}<div class='triple'>{spheres}</div>"
        f"<p class='sub'>Lit spheres, key light π at the upper left. Error: of the cube root of "
        f"ρ cos θ over all directions.</p><table>{rows}</table>"
        f"<div class='charts'>{charts}</div><p class='sub'>Reflectance in the plane of incidence, "
        f"light from the left; a curve for each of red, green and blue{shaded}; dots: "
        f"samples within {np.degrees(NEAR_PLANE):.0f}° of it.</p>"
    )


def _spheres(folder: Path, material: MaterialResult) -> str:
    """Figures of the measured BRDF, its lobe stack and its Principled, side by side."""
    lobes, principled = material.lobes, material.principled
    shown: list[tuple[str, str, Reflector]] = [
        ("", "measured: Cycles with OSL", material.fit.brdf.evaluate),
        ("_lobes", f"lobe stack: EEVEE, error {100 * lobes.error:.1f} %", lobes.stack),
        (
            "_principled",
            f"Principled: exports, error {100 * principled.error:.1f} %",
            principled.principled,
        ),
    ]
    cells = []
    for suffix, label, reflector in shown:
        name = f"sphere_{material.name}{suffix}.png"
        write_sphere(folder / name, reflector)
        cells.append(
            f"<figure><img src='{escape(quote(name))}' alt='lit sphere, {label}'>"
            f"<figcaption>{label}</figcaption></figure>"
        )
    return "".join(cells)


def _photo_rows(folder: Path, result: CaptureResult, body: list[str]) -> Iterator[float]:
    """Add all photos to the page; yields the fraction done of the whole."""
    count = len(result.materials) + len(result.capture.photos)
    body.append(
        "<h2>Photo, prediction, difference</h2><p class='sub'>Each prediction is made from the "
        "scanned mesh, the light and the fitted materials: direct light and cast shadows. "
        "Difference: <span class='key'></span> prediction too dark … too bright, full colour at "
        "± 30 % of the photo's white. Dark grey: no surface or no material.</p>"
    )
    for place in range(len(result.capture.photos)):
        yield (len(result.materials) + place) / count
        body.append(_photo_row(folder, result, place))


def _photo_row(folder: Path, result: CaptureResult, place: int) -> str:
    capture = result.capture
    camera = inputs.camera_of(capture, result.scan, place)
    light = result.lights.of(capture, place)
    masks = inputs.photo_masks(capture, place)
    lines = PixelRays.of(camera)
    seen = np.zeros((camera.height, camera.width), bool)
    predicted = np.full((*seen.shape, 3), np.nan, np.float32)
    for window in bands(camera, halo=0, columns=result.rays.cover.columns(camera)):
        view = view_window(result.rays, lines, window)
        where, _ = inputs.material_pixels(capture, result.scan, view, place, masks)
        parts = [(where[m.name], m.fit.brdf, m.scale) for m in result.materials]
        target = slice(window.first, window.last), slice(window.left, window.right)
        predicted[target] = predict_photo(result.rays, view, light, camera, parts).radiance
        seen[target] = view.seen
    measured = result.photos.read(place).radiance
    box = display.crop_box(seen, margin=12)
    a = display.shrink(measured[box], LONGEST)
    b = display.shrink(predicted[box], LONGEST)
    white = display.white_level(measured[box][seen[box]])
    names = [f"photo_{place:02d}_{kind}.png" for kind in ("measured", "predicted", "difference")]
    write_png(folder / names[0], display.photo_picture(a, white))
    write_png(folder / names[1], display.photo_picture(b, white))
    write_png(folder / names[2], display.difference_picture(b, a, 0.3 * white))
    error = _relative_error(predicted, measured)
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
    missed = size = 0.0
    for top in range(0, len(predicted), ROWS):
        ours, photo = predicted[top : top + ROWS], measured[top : top + ROWS]
        known = np.isfinite(ours[..., 0])
        missed += float(np.sum(np.square((ours - photo)[known], dtype=np.float64)))
        size += float(np.sum(np.square(photo[known], dtype=np.float64)))
    return (missed / max(size, 1e-300)) ** 0.5
