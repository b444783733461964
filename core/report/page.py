"""The report of a fit: one HTML page and its pictures, in one folder, no network needed."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path

import numpy as np

from ..geometry import PixelRays, bands, view_window
from ..job import CaptureResult, inputs
from ..photo import write_png
from ..predict.compose import predict_photo
from . import display
from .material_section import material_section

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
        body.append(material_section(folder, material, photos))
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
