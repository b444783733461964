"""The report of a fit: one HTML page and its pictures in one folder; it needs no network."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path

from ..concurrency.steps import drained
from ..counted import counted
from ..fit import PaperFit
from ..jobs import CaptureResult
from ..photo import write_png
from ..samples import Criterion
from ..views import photo_pictures, photo_view
from ..views.criteria import LOOKS, Look
from .material_section import material_section

STYLE = Path(__file__).parents[2] / "assets" / "report" / "style.css"
MAX_SIDE = 640  # pixels of a picture in a row of photos


def write_report(folder: Path, result: CaptureResult) -> Iterator[float]:
    """Write index.html and its pictures into ``folder``; yields the fraction done."""
    folder.mkdir(parents=True, exist_ok=True)
    body = [f"<p>Included in the fit: {escape(e.sentence)}</p>" for e in result.effects]
    photos = [result.capture.photo_name(place) for place in range(len(result.capture.photos))]
    count = len(result.materials) + len(result.capture.photos)
    for done, material in enumerate(result.materials):
        yield done / count
        body.append(material_section(folder, material, photos))
    # the predictions use the light and camera of the capture, without the causes of a diagnosis
    if not result.effects:
        yield from _photo_rows(folder, result, body)
    head = (
        f"{counted(len(result.capture.photos), 'lit photo')} · "
        f"{counted(len(result.scan.mesh.faces), 'face')} · basis {result.basis.version}"
    )
    html = page(result.capture.file.name, "".join(body), head)
    (folder / "index.html").write_text(html, "utf-8")


def page(name: str, body: str, head: str = "") -> str:
    """A complete HTML page about a capture; body: HTML; head: plain text below the title."""
    title = escape(name)
    line = title if not head else f"{title} · {escape(head)}"
    return (
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>Patina: {title}</title>"
        f"<style>{STYLE.read_text('utf-8')}</style><h1>Patina report</h1><p class='sub'>{line}</p>"
        f"{body}</html>"
    )


def _photo_rows(folder: Path, result: CaptureResult, body: list[str]) -> Iterator[float]:
    """Add a row for each photo to ``body``; yields the fraction done of the whole report."""
    count = len(result.materials) + len(result.capture.photos)
    body.append("")  # placeholder: the legend lists only the criteria that the photos show
    place_of_head, found_criteria = len(body) - 1, set[Criterion]()
    for place in range(len(result.capture.photos)):
        yield (len(result.materials) + place) / count
        view = drained(
            photo_view.look_at_photo(
                result.capture,
                result.scan,
                result.rays,
                result.photos,
                result.lights,
                [(m.name, m.fit.brdf, m.scale) for m in result.materials],
                place,
                photo_view.chosen_pixels([m.fit for m in result.materials], place),
                result.varying,
            )
        )
        found_criteria.update(view.shares)
        body.append(_photo_row(folder, view))
    paper = any(isinstance(m.fit, PaperFit) for m in result.materials)
    body[place_of_head] = _head_of_photos(found_criteria, paper)


def _head_of_photos(found_criteria: set[Criterion], ringed: bool) -> str:
    """HTML heading and legend of the rows of photos; found_criteria: those in any photo."""
    rings = " Rings: the pixels that the fit uses." if ringed else ""
    looks = [LOOKS[criterion] for criterion in sorted(found_criteria)]
    rows = "".join(
        f"<tr><th>{_chip(look)}&nbsp;{escape(look.word)}</th><td>{escape(look.advice)}</td></tr>"
        for look in looks
    )
    return (
        "<h2>Photo, prediction, difference, where samples came from</h2><p class='sub'>Each "
        "prediction is computed from the scanned mesh, the light and the fitted materials: direct "
        "light and cast shadows. Difference: <span class='key'></span> prediction too dark … too "
        "bright, full colour at ± 30 % of the photo's white. Dark grey: no surface or no material. "
        "The last picture shows the criterion that decided about each pixel; the list below it "
        f"gives the share of the surface for each criterion.{rings}</p><details><summary>The "
        f"criteria, and what to do</summary><table>{rows}</table></details>"
    )


def _photo_row(folder: Path, view: photo_view.PhotoView) -> str:
    """HTML of the four pictures of a photo; writes them into ``folder``."""
    pictures = {
        **photo_pictures.compared(view, MAX_SIDE)._asdict(),
        "samples": photo_pictures.criteria_picture(view, MAX_SIDE),
    }
    name = escape(view.name)
    labels = (
        f"{name}: photo",
        "Prediction",
        f"Difference, relative RMS error {100 * view.error:.1f} %",
        "Where samples came from",
    )
    cells = ""
    for (kind, picture), label in zip(pictures.items(), labels, strict=True):
        file = f"photo_{view.place:02d}_{kind}.png"
        write_png(folder / file, picture)
        counts = _counts(view) if kind == "samples" else ""
        cells += (
            f"<figure><img src='{file}' alt='{label}' loading='lazy'><figcaption>{label}{counts}"
            "</figcaption></figure>"
        )
    return f"<div class='quadruple'>{cells}</div>"


def _counts(view: photo_view.PhotoView) -> str:
    """HTML list of the share of the surface for each criterion, the largest first."""
    shares = sorted(view.shares.items(), key=lambda item: -item[1])
    rows = "".join(
        f"<li title='{escape(LOOKS[c].advice, quote=True)}'>{_chip(LOOKS[c])}{_percent(share)} "
        f"{escape(LOOKS[c].word)}</li>"
        for c, share in shares
    )
    return f"<ul class='counts'>{rows}</ul>"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.01 else "&lt; 1 %"


def _chip(look: Look) -> str:
    red, green, blue = look.colour
    return f"<span class='chip' style='background:rgb({red},{green},{blue})'></span>"
