"""The report of a fit: one HTML page and its pictures, in one folder, no network needed."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path

from ..concurrency.steps import drained
from ..fit import PaperFit
from ..jobs import CaptureResult
from ..photo import write_png
from ..samples import Criterion
from ..views import photo_pictures, photo_view
from ..views.criteria import LOOKS, Look
from .material_section import material_section

STYLE = Path(__file__).parents[2] / "assets" / "report" / "style.css"
LONGEST = 640


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
    body.append("")  # what explains the rows comes once they are known
    place_of_head, met = len(body) - 1, set[Criterion]()
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
            )
        )
        met.update(view.shares)
        body.append(_photo_row(folder, view))
    paper = any(isinstance(m.fit, PaperFit) for m in result.materials)
    body[place_of_head] = _head_of_photos(met, paper)


def _head_of_photos(met: set[Criterion], ringed: bool) -> str:
    """What the four pictures are; met: the criteria that some photo shows."""
    rings = " Rings: the pixels that the fit rests on." if ringed else ""
    looks = [LOOKS[criterion] for criterion in sorted(met)]
    rows = "".join(
        f"<tr><th>{_chip(look)}&nbsp;{escape(look.word)}</th><td>{escape(look.advice)}</td></tr>"
        for look in looks
    )
    return (
        "<h2>Photo, prediction, difference, where samples came from</h2><p class='sub'>Each "
        "prediction is made from the scanned mesh, the light and the fitted materials: direct "
        "light and cast shadows. Difference: <span class='key'></span> prediction too dark … too "
        "bright, full colour at ± 30 % of the photo's white. Dark grey: no surface or no material. "
        "The last picture says what decided about each pixel, the figures below it what part of "
        f"the surface that is.{rings}</p><details><summary>What decides about a pixel, and what to "
        f"do</summary><table>{rows}</table></details>"
    )


def _photo_row(folder: Path, view: photo_view.PhotoView) -> str:
    pictures = {
        **photo_pictures.compared(view, LONGEST)._asdict(),
        "samples": photo_pictures.criteria_picture(view, LONGEST),
    }
    name = escape(view.name)
    labels = (
        f"{name}: photo",
        "prediction",
        f"difference, relative RMS {100 * view.error:.1f} %",
        "where samples came from",
    )
    cells = ""
    for (kind, picture), label in zip(pictures.items(), labels, strict=True):
        file = f"photo_{view.place:02d}_{kind}.png"
        write_png(folder / file, picture)
        told = _counts(view) if kind == "samples" else ""
        cells += (
            f"<figure><img src='{file}' alt='{label}' loading='lazy'><figcaption>{label}{told}"
            "</figcaption></figure>"
        )
    return f"<div class='quadruple'>{cells}</div>"


def _counts(view: photo_view.PhotoView) -> str:
    """Which part of the surface each criterion decided about, the largest first."""
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
