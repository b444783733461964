"""The pages of a diagnosis: what the model gets wrong, where, and what helps."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

import numpy as np

from ..diagnose.forward.diagnosis_context import DiagnosisContext
from ..diagnose.selection.diagnosis import Diagnosis, Trial
from ..diagnose.selection.residual_trends import Trend, coordinates, trend
from ..jobs import CaptureResult
from ..photo import write_png
from ..views.sphere import write_sphere
from .page import page
from .residual_picture import photo_most_changed, residual_picture
from .trend_chart import trend_chart

MOST_SHOWN = 6  # charts: those along which the residual changes most
STEPS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # of a chart's vertical axis


def write_pages(
    folder: Path,
    found: Diagnosis,
    context: DiagnosisContext,
    before: CaptureResult,
    after: CaptureResult,
) -> Path:
    """index.html and pictures; before, after: the fits without and with what was named."""
    folder.mkdir(parents=True, exist_ok=True)
    body = section(found, context) + _evidence(folder, found, context)
    body += _materials(folder, before, after)
    html = page(before.capture.file.name, body + _pictures(folder, found, context))
    (folder / "index.html").write_text(html, "utf-8")
    return folder / "index.html"


def _pictures(folder: Path, found: Diagnosis, context: DiagnosisContext) -> str:
    """HTML: what each photo shows more than the prediction, before and after."""
    pixels, rows = context.pixels, []
    fits = {"before": found.before, "after": found.after}
    if not found.named:
        fits = {"before": found.before}
    for photo in np.unique(pixels.photo):
        pictures = ""
        for kind, fitted in fits.items():
            file = f"residual_{photo:02d}_{kind}.png"
            # both in the deviations of before: a picture may become paler, not its measure
            residual = fitted.residual * (fitted.deviation / found.before.deviation)
            write_png(folder / file, residual_picture(pixels, residual, int(photo)))
            pictures += f"<img src='{file}' alt='{kind}'>"
        rows.append(f"<figure>{pictures}<figcaption>photo {photo + 1}</figcaption></figure>")
    what = "before and after" if found.named else "as it is"
    return (
        f"<h2>Where it is wrong, {what}</h2><p class='sub'><span class='key'></span> prediction "
        "too dark … too bright, full colour at three times what such a pixel usually misses.</p>"
        f"<div class='residuals'>{''.join(rows)}</div>"
    )


def section(found: Diagnosis, context: DiagnosisContext) -> str:
    """HTML: the ranking, then the residual along what betrays causes."""
    left = f"<p>{escape(found.residual.sentence())}</p>" if found.unexplained else ""
    rows = "".join(_row(t, found) for t in found.ranked)
    named = ", ".join(found.causes) or "nothing that can be named"
    return (
        f"<h2>What is wrong</h2><p><b>{escape(named)}</b></p>{left}"
        "<p class='sub'>A gain is what the model with a cause predicts better of parts of the "
        "photos that it was not fitted to, in standard errors.</p>"
        f"{_errors(found)}<table><tr><th>cause</th><th>gain</th><th></th><th>what it would mean"
        f"</th></tr>{rows}</table><div class='charts'>{_charts(found, context)}</div>"
        "<p class='sub'>What the photos show more than the prediction, relative; red before, blue "
        "after; bars: two standard errors.</p>"
    )


def _errors(found: Diagnosis) -> str:
    """HTML: how well what was left out is predicted."""
    before, after = found.error_before, found.error_after
    rows = [
        ("RMS error of left-out parts of the photos", before.parts, after.parts),
        ("RMS error of left-out photos", before.photos, after.photos),
    ]
    cells = "".join(
        f"<tr><th>{what}</th><td>{100 * a:.1f} %</td><td>{100 * b:.1f} %</td></tr>"
        for what, a, b in rows
        if a is not None and b is not None
    )
    floor, noise = (
        (before.over_floor, after.over_floor), (before.not_noise, after.not_noise)
    )  # fmt: skip
    return (
        f"<table><tr><th></th><th>before</th><th>after</th></tr>{cells}<tr><th>part of the typical "
        f"squared error that is not the photos' noise</th><td>{100 * noise[0]:.0f} %</td><td>"
        f"{100 * noise[1]:.0f} %</td></tr><tr><th>typical error over what noise and the scan's "
        f"known errors make</th><td>{floor[0]:.2f}</td><td>{floor[1]:.2f}</td></tr></table>"
    )


def evidence_file(cause: str) -> str:
    """The picture of what a cause changes."""
    return f"evidence_{cause}.png"


def _evidence(folder: Path, found: Diagnosis, context: DiagnosisContext) -> str:
    """HTML: what each cause that is named changes, in the photo that it changes most."""
    cells, pixels = "", context.pixels
    for trial in found.named:
        changed = trial.changed() / found.before.deviation
        photo = photo_most_changed(pixels, changed)
        if photo is None:
            continue
        cause, file = trial.effect.cause, evidence_file(trial.effect.cause)
        write_png(folder / file, residual_picture(pixels, -changed, photo))
        cells += (
            f"<figure><img src='{file}' alt='{cause}'><figcaption>{cause} in photo {photo + 1}"
            "</figcaption></figure>"
        )
    if not cells:
        return ""
    return (
        "<h2>What the causes do</h2><p class='sub'><span class='key'></span> darker … brighter by "
        "the cause, in the photo that it changes most, full colour at three times what such a "
        f"pixel usually misses.</p><div class='residuals'>{cells}</div>"
    )


def _materials(folder: Path, before: CaptureResult, after: CaptureResult) -> str:
    """HTML: each material as a sphere, without and with what was named."""
    if not after.effects:
        return ""
    rows = ""
    for one, other in zip(before.materials, after.materials, strict=True):
        cells = ""
        for suffix, said, material in (("before", "before", one), ("after", "after", other)):
            name = f"sphere_{one.name}_{suffix}.png"
            write_sphere(folder / name, material.fit.brdf.evaluate)
            held = material.held_out
            told = (
                ""
                if held is None
                else f": unseen photos to {100 * held.typical:.1f} % (RMS {100 * held.error:.1f} %)"
            )
            cells += (
                f"<figure><img src='{escape(quote(name))}' alt='lit sphere, {said}'>"
                f"<figcaption>{escape(one.name)}, {said}{told}</figcaption></figure>"
            )
        rows += f"<div class='triple'>{cells}</div>"
    causes = ", ".join(effect.cause for effect in after.effects)
    return (
        f"<h2>The material with {escape(causes)} in the model</h2>{rows}<p class='sub'>Photos are "
        "corrected by what was named before the second fit sees them; the second material is the "
        "proposed one. <a href='materials/index.html'>Its own report</a>.</p>"
    )


def _row(trial: Trial, found: Diagnosis) -> str:
    named = trial in found.named
    sure = trial.gain / max(trial.error, 1e-9)
    width = int(np.clip(12 * sure, 0, 160))
    said = found.sentence(trial) if trial in found.reported else ""
    style = "background:#2f6fb0" if named else "background:#bbb"
    return (
        f"<tr><th>{escape(trial.effect.cause)}</th><td>{sure:.1f}</td><td><div style='height:10px;"
        f"width:{width}px;{style}'></div></td><td>{escape(said)}</td></tr>"
    )


def _charts(found: Diagnosis, context: DiagnosisContext) -> str:
    drawn = []
    block = context.pixels.block
    for coordinate in coordinates(context):
        trends = []
        for fitted in (found.before, found.after):
            missed = context.pixels.observed - fitted.predicted
            trends.append(trend(coordinate, missed, fitted.predicted, fitted.deviation, block))
        before = trends[0]
        if len(before.at):
            drawn.append((_sure_size(before), coordinate, trends))
    drawn.sort(key=lambda d: -d[0])
    chosen = drawn[:MOST_SHOWN]
    return "".join(
        f"<figure>{trend_chart(c.name, c.unit, ts[0], ts[1] if found.named else None, _axis(ts))}"
        "</figure>"
        for _, c, ts in chosen
    )


def _sure_size(one: Trend) -> float:
    """RMS of what it certainly is off by: a bin of few dark pixels is not the largest trend."""
    return float(np.sqrt(np.mean(np.maximum(np.abs(one.mean) - 2 * one.error, 0) ** 2)))


def _axis(trends: Sequence[Trend]) -> float:
    """Of a chart of its own: beside what dark pixels are off by, every other trend is a line."""
    sure = [t.mean[np.abs(t.mean) > 2 * t.error] for t in trends]
    largest = max(float(np.abs(mean).max(initial=0.0)) for mean in sure)
    return next((step for step in STEPS if step >= largest), STEPS[-1])
