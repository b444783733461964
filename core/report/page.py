"""The report of a fit: one HTML page and its pictures in one folder; it needs no network."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from html import escape
from pathlib import Path

from ..concurrency.ordered_map import ordered_map
from ..concurrency.steps import drained
from ..concurrency.thread_pool import thread_count, thread_pool
from ..counted import counted
from ..fit import PaperFit
from ..fit.fit_quality import FitQuality
from ..jobs import CaptureResult, MaterialResult
from ..photo import write_png
from ..samples import Criterion
from ..viewer.page import FILE_NAME, has_program
from ..viewer.photo_layers import DIFFERENCE, PHOTO, PREDICTION, PhotoLayers, shown_places
from ..views import photo_pictures, photo_view
from ..views.criteria import LOOKS, Look
from .held_out import varied_quality
from .html_parts import ERROR_HEADING, PHOTO_HEADING, page, summary
from .material_section import material_section
from .variation_section import variation_section
from .viewer_page import write_viewer_of

MAX_SIDE = 640  # pixels of a picture in a row of photos
VIEWER_LINK = (
    "<p><a class='button' href='{file}'>Open the Viewer</a>object and sphere with the measured "
    "materials, to turn and to light</p>"
)
PHOTOS_AT_ONCE = 2  # limits memory: each has a photo in its full size for a moment


def write_report(
    folder: Path,
    result: CaptureResult,
    threads: int | None = None,
    back: str = "",
    layers: Sequence[PhotoLayers] = (),
) -> Iterator[float]:
    """Write index.html and its pictures into ``folder``; yields the fraction done. threads: None
    for one per core. back: the page of the check that this report is a part of, relative to the
    folder. layers: the photos of the viewer where the result takes causes into account; else they
    are those of the report."""
    folder.mkdir(parents=True, exist_ok=True)
    photos = [result.capture.photo_name(place) for place in range(len(result.capture.photos))]
    sections: list[Callable[[], str | photo_view.PhotoView]] = [
        partial(material_section, folder, material, photos) for material in result.materials
    ]
    if result.varying is not None and result.varying.varies:
        sections.append(partial(variation_section, folder, result, result.varying))
    # the predictions use the light and camera of the capture, without the causes of a diagnosis
    if not result.effects:
        sections += [partial(_looked_at, result, place) for place in range(len(photos))]
    body = [_summary(result, FILE_NAME if has_program() else None)]
    shown = shown_places(len(photos))
    rows, found_criteria, factors = [], set[Criterion](), set[int]()
    with thread_pool(min(thread_count(threads), PHOTOS_AT_ONCE)) as pool:
        made = ordered_map(pool, lambda section: section(), sections, PHOTOS_AT_ONCE - 1)
        for done, section in enumerate(made):
            yield done / len(sections)
            if isinstance(section, str):
                body.append(section)
                continue
            found_criteria.update(section.shares)
            factors.add(section.factor)
            row, photo = _photo_row(folder, section)
            rows.append(row)
            if has_program() and section.place in shown:
                layers = [*layers, photo]
    write_viewer_of(folder, result, layers)
    if rows:
        paper = any(isinstance(m.fit, PaperFit) for m in result.materials)
        body += [_head_of_photos(found_criteria, paper, max(factors)), *rows]
    head = (
        f"{counted(len(result.capture.photos), 'lit photo')} · "
        f"{counted(len(result.scan.mesh.faces), 'face')} · basis {result.basis.version}"
    )
    html = page("Measured materials", result.capture.file.name, "".join(body), head, back)
    (folder / "index.html").write_text(html, "utf-8")


def _summary(result: CaptureResult, viewer: str | None) -> str:
    """HTML: what a reader wants to know first."""
    varied = varied_quality(result)
    pictures = [(f"sphere_{material.name}.png", material.name) for material in result.materials]
    if varied and not result.effects:  # a sphere of the typical material says little
        pictures = [("photo_00_prediction.png", f"Prediction of {result.capture.photo_name(0)}")]
    held_out = "".join(
        f"<li>{escape(material.name)}: {_held_out(material, varied.get(material.name))}</li>"
        for material in result.materials
    )
    parts = [(ERROR_HEADING, f"<ul>{held_out}</ul>")]
    if result.effects:
        included = "".join(f"<li>{escape(e.sentence)}</li>" for e in result.effects)
        parts.append(("Problems of the capture, corrected in this fit", f"<ul>{included}</ul>"))
    if result.proposed_photo is not None:
        sentence = escape(result.proposed_photo.sentence)
        parts.append((PHOTO_HEADING, f"<p>{sentence}</p>"))
    if viewer is not None:
        parts.append(("", VIEWER_LINK.format(file=viewer)))
    return summary(pictures, parts)


def _held_out(material: MaterialResult, varied: FitQuality | None) -> str:
    """HTML: the typical error. varied: with the variation over the surface."""
    quality = varied or material.quality
    if quality.typical is None:
        return "unknown; two photos or more are needed"
    text = f"<span class='big'>{100 * quality.typical:.1f} %</span> ({quality.rating.value})"
    if varied is None or material.quality.typical is None:
        return text
    return f"{text}; {100 * material.quality.typical:.0f} % if it were the same everywhere"


def _looked_at(result: CaptureResult, place: int) -> photo_view.PhotoView:
    """A photo and its prediction, at about the size of its pictures."""
    return drained(
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
            MAX_SIDE,
        )
    )


def _head_of_photos(found_criteria: set[Criterion], ringed: bool, factor: int) -> str:
    """HTML heading and legend of the rows of photos; found_criteria: those in any photo; factor: by
    which the photos are reduced at most."""
    reduced = (
        ""
        if factor == 1
        else f" Large photos are reduced first, up to {factor} × {factor} pixels to one: errors "
        "and shares are those of the reduced photos."
    )
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
        f"gives the share of the surface for each criterion.{rings}{reduced}</p><details><summary>"
        f"The criteria, and what to do</summary><table>{rows}</table></details>"
    )


def _photo_row(folder: Path, view: photo_view.PhotoView) -> tuple[str, PhotoLayers]:
    """(HTML of the four pictures of a photo, three of them for the viewer); writes them into
    ``folder``."""
    found = photo_pictures.compared(view, MAX_SIDE)
    layers = {PHOTO: found.photo, PREDICTION: found.prediction, DIFFERENCE: found.difference}
    pictures = {
        **found._asdict(),
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
    return f"<div class='quadruple'>{cells}</div>", PhotoLayers(view.name, layers, {})


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
