"""The HTML report of a diagnosis: residuals, where they are, and the causes that explain them."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from ..diagnose.assessment.assessment import Assessment
from ..diagnose.assessment.scan_rating import rated_figures
from ..diagnose.effects.actions import ACTIONS
from ..diagnose.effects.labels import ORIGINS, cause_label, origin_of
from ..diagnose.forward.diagnosis_context import DiagnosisContext
from ..diagnose.selection.diagnosis import Diagnosis, Trial
from ..diagnose.selection.residual_trends import Trend, coordinates, trend
from ..diagnose.selection.scan_quality import ScanQuality
from ..fit.fit_quality import Rating
from ..jobs import CaptureResult
from ..photo import write_png
from ..viewer.page import FILE_NAME, has_program
from ..views.sphere import write_sphere
from .assessment_section import assessment_section
from .html_parts import ERROR_HEADING, PHOTO_HEADING, compared, page, summary
from .residual_picture import (
    change_by,
    photo_most_changed,
    radiance_picture,
    residual_picture,
    scaled_residual,
    white_of,
)
from .trend_chart import trend_chart

MAX_CHARTS = 6  # those of the coordinates along which the residual varies most
STEPS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # possible limits of a chart's vertical axis, relative


def write_pages(
    folder: Path,
    found: Diagnosis,
    assessment: Assessment,
    context: DiagnosisContext,
    before: CaptureResult,
    after: CaptureResult,
) -> Path:
    """Write index.html and pictures into ``folder``. assessment: of the last joint fit. before,
    after: the fits without and with a correction for the named causes. Returns the path of
    index.html."""
    folder.mkdir(parents=True, exist_ok=True)
    body = _summary(found, before, after) + _evidence(folder, found, context)
    body += _materials(folder, before, after)
    body += _pictures(folder, found, context) + section(found, context)
    body += assessment_section(assessment)
    html = page("Check of the capture", before.capture.file.name, body)
    (folder / "index.html").write_text(html, "utf-8")
    return folder / "index.html"


def _summary(found: Diagnosis, before: CaptureResult, after: CaptureResult) -> str:
    """HTML: what a reader wants to know first."""
    corrected = bool(after.effects)
    kind = "after" if corrected else "materials/sphere"
    pictures = [(f"{kind}_{material.name}.png", material.name) for material in after.materials]
    rows = ""
    for one, other in zip(before.materials, after.materials, strict=True):
        if other.held_out is None:
            continue
        now = f"<span class='big'>{100 * other.held_out.typical:.1f} %</span>"
        earlier = ""
        if corrected and one.held_out is not None:
            earlier = f" ({100 * one.held_out.typical:.1f} % before correction)"
        rows += f"<li>{escape(other.name)}: {now}{earlier}</li>"
    applied = {effect.cause for effect in after.effects}
    causes = "".join(
        f"<li>{escape(found.sentence(trial))}"
        f"{' Corrected in these materials.' if trial.effect.cause in applied else ''}"
        f"{_advice(found, trial)}</li>"
        for trial in found.reported
    )
    if found.unexplained:
        causes += f"<li>{escape(found.unexplained_sentence)}</li>"
    nothing = "<li>Nothing: noise and errors of the scan explain the differences.</li>"
    parts = [
        (ERROR_HEADING, f"<ul>{rows}</ul>" if rows else "<p>unknown</p>"),
        ("Problems of the capture", f"<ul>{causes or nothing}</ul>"),
        ("Quality of the scan", _scan_quality(found.quality)),
    ]
    if after.proposed_photo is not None:
        sentence = escape(after.proposed_photo.sentence)
        parts.append((PHOTO_HEADING, f"<p>{sentence}</p>"))
    links = "<a class='button' href='materials/index.html'>Report of the Materials</a>"
    if has_program():
        links += f"<a class='button' href='materials/{FILE_NAME}'>Open the Viewer</a>"
    parts.append(("", f"<p>{links}</p>"))
    return summary(pictures, parts)


def _scan_quality(quality: ScanQuality) -> str:
    """HTML: each figure with its rating, and what to do where that is not good."""
    rows = ""
    for figure in rated_figures(quality.figures()):
        rating = figure.rating.value
        remedy = "" if figure.rating is Rating.GOOD else f"<br>{escape(figure.remedy)}."
        rows += (
            f"<li class='{rating}'>{figure.label} {figure.value} ({rating}): "
            f"{escape(figure.meaning)}{remedy}</li>"
        )
    return f"<ul class='ratings'>{rows}</ul>"


def _advice(found: Diagnosis, trial: Trial) -> str:
    if trial not in found.named:
        return ""
    return f"<br>For the next capture: <b>{escape(ACTIONS[trial.effect.cause])}</b>"


def _pictures(folder: Path, found: Diagnosis, context: DiagnosisContext) -> str:
    """HTML: each photo with its prediction, and the residual, before and after."""
    pixels, rows = context.pixels, []
    corrected = bool(found.named)
    fits = {"before": found.before, "after": found.after} if corrected else {"before": found.before}
    residuals = {kind: scaled_residual(found, fitted) for kind, fitted in fits.items()}
    for photo in np.unique(pixels.photo).tolist():
        white = white_of(pixels, photo)
        shown = {"photo": pixels.observed, "prediction": found.after.predicted}
        for kind, radiance in shown.items():
            picture = radiance_picture(pixels, radiance, photo, white)
            write_png(folder / f"compared_{photo:02d}_{kind}.png", picture)
        pair = compared(
            f"compared_{photo:02d}_photo.png",
            f"compared_{photo:02d}_prediction.png",
            (f"photo {photo + 1}", "prediction"),
        )
        for kind, residual in residuals.items():
            file = folder / f"residual_{photo:02d}_{kind}.png"
            write_png(file, residual_picture(pixels, residual, photo))
        if corrected:
            pair += compared(
                f"residual_{photo:02d}_before.png",
                f"residual_{photo:02d}_after.png",
                ("before", "after correction"),
            )
        else:
            name = f"residual_{photo:02d}_before.png"
            pair += f"<figure><img src='{name}' alt='difference'></figure>"
        rows.append(f"<div>{pair}</div>")
    return (
        "<h2>Photos, predictions and differences</h2><p class='sub'>Move the dividers to compare. "
        f"Only pixels that the check uses{', predictions after correction' if corrected else ''}. "
        "Differences: <span class='key'></span> prediction too dark … too bright, full "
        "colour at three times the standard deviation of the pixel's residual.</p>"
        f"<div class='pairs'>{''.join(rows)}</div>"
    )


def section(found: Diagnosis, context: DiagnosisContext) -> str:
    """HTML: the ranked causes, then charts of the residual along the diagnostic coordinates."""
    named = ", ".join(map(cause_label, found.causes)) or "No known cause found."
    return (
        f"<h2>Causes in numbers</h2><p><b>{escape(named)}</b></p>"
        "<p class='sub'>Gain: improvement of the prediction of held-out regions of the photos by "
        "the model with this cause, in standard errors.</p>"
        f"{_errors(found)}{_causes(found)}<div class='charts'>{_charts(found, context)}</div>"
        "<p class='sub'>Residual (photo minus prediction) relative to the prediction. Red: before "
        "correction, blue: after. Bars: two standard errors. Point at a chart for its values.</p>"
    )


def _causes(found: Diagnosis) -> str:
    """HTML: the reported causes by their origin, then, folded, what was tested without success."""
    html = ""
    for origin in (*ORIGINS, "Other"):
        mine = [t for t in found.reported if origin_of(t.effect.cause) == origin]
        html += f"<h3>{origin}</h3>{_table(mine, found)}" if mine else ""
    others = [t for t in found.ranked if t not in found.reported]
    if others:
        html += (
            f"<details><summary>Tested, not accepted ({len(others)})</summary><p class='sub'>Gains "
            "are those before the accepted causes were included. With these in the model, the "
            "causes below do not improve the prediction of the photos enough.</p>"
            f"{_table(sorted(others, key=lambda trial: -trial.ratio), found)}</details>"
        )
    return html


def _table(trials: Sequence[Trial], found: Diagnosis) -> str:
    rows = "".join(_row(trial, found) for trial in trials)
    return f"<table><tr><th>Cause</th><th>Gain</th><th></th><th>Meaning</th></tr>{rows}</table>"


def _errors(found: Diagnosis) -> str:
    """HTML: errors of the prediction of held-out regions and photos."""
    before, after = found.error_before, found.error_after
    rows = [
        ("RMS error of held-out regions of the photos", before.parts, after.parts),
        ("RMS error of held-out photos", before.photos, after.photos),
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
        f"<table><tr><th></th><th>Before</th><th>After</th></tr>{cells}<tr><th>Fraction of the "
        f"typical squared error that is not photo noise</th><td>{100 * noise[0]:.0f} %</td><td>"
        f"{100 * noise[1]:.0f} %</td></tr><tr><th>Typical error relative to photo noise and "
        f"known scan errors</th><td>{floor[0]:.2f}</td><td>{floor[1]:.2f}</td></tr></table>"
    )


def evidence_file(cause: str) -> str:
    """File name of the picture of the change that a cause makes."""
    return f"evidence_{cause}.png"


def _evidence(folder: Path, found: Diagnosis, context: DiagnosisContext) -> str:
    """HTML: the change by each named cause, in the photo that it changes most."""
    cells, pixels = "", context.pixels
    for trial in found.named:
        changed = change_by(found, trial)
        photo = photo_most_changed(pixels, changed)
        if photo is None:
            continue
        cause, file = trial.effect.cause, evidence_file(trial.effect.cause)
        write_png(folder / file, residual_picture(pixels, -changed, photo))
        cells += (
            f"<figure><img src='{file}' alt='{cause_label(cause)}'><figcaption>"
            f"{cause_label(cause)} in photo {photo + 1}</figcaption></figure>"
        )
    if not cells:
        return ""
    return (
        "<h2>Effects of the causes</h2><p class='sub'><span class='key'></span> The cause makes "
        "the photo darker … brighter, shown for the photo that it changes most. Full colour: three "
        f"times the standard deviation of the pixel's residual.</p><div class='residuals'>{cells}"
        "</div>"
    )


def _materials(folder: Path, before: CaptureResult, after: CaptureResult) -> str:
    """HTML: each material as a lit sphere, without and with a correction for the named causes."""
    if not after.effects:
        return ""
    rows = ""
    for one, other in zip(before.materials, after.materials, strict=True):
        labels = []
        for stage, material in (("before", one), ("after", other)):
            write_sphere(folder / f"{stage}_{one.name}.png", material.fit.brdf.evaluate)
            held = material.held_out
            error = "" if held is None else f": {100 * held.typical:.1f} %"
            labels.append(f"{one.name}, {stage}{error}")
        pair = compared(f"before_{one.name}.png", f"after_{one.name}.png", (labels[0], labels[1]))
        rows += f"<div>{pair}</div>"
    causes = ", ".join(cause_label(effect.cause) for effect in after.effects)
    return (
        f"<h2>Materials corrected for {escape(causes)}</h2><div class='pairs'>{rows}</div><p "
        "class='sub'>The samples are corrected for the named causes before the second fit. The "
        "material after correction is the proposed one.</p>"
    )


def _row(trial: Trial, found: Diagnosis) -> str:
    named = trial in found.named
    width = int(np.clip(12 * trial.ratio, 0, 160))
    meaning = escape(found.sentence(trial)) if trial in found.reported else ""
    style = "background:#2f6fb0" if named else "background:#bbb"
    return (
        f"<tr><th>{escape(cause_label(trial.effect.cause))}</th><td>{trial.ratio:.1f}</td><td>"
        f"<div style='height:10px;width:{width}px;{style}'></div></td>"
        f"<td>{meaning}</td></tr>"
    )


def _charts(found: Diagnosis, context: DiagnosisContext) -> str:
    drawn = []
    block = context.pixels.block
    for coordinate in coordinates(context):
        trends = []
        for fitted in (found.before, found.after):
            residual = context.pixels.observed - fitted.predicted
            trends.append(trend(coordinate, residual, fitted.predicted, fitted.deviation, block))
        before = trends[0]
        if len(before.at):
            drawn.append((_significant_size(before), coordinate, trends))
    drawn.sort(key=lambda d: -d[0])
    shown = drawn[:MAX_CHARTS]
    return "".join(
        f"<figure>{trend_chart(c.name, c.unit, ts[0], ts[1] if found.named else None, _axis(ts))}"
        "</figure>"
        for _, c, ts in shown
    )


def _significant_size(one: Trend) -> float:
    """RMS of the trend beyond two standard errors, so that a bin of few dark pixels does not rank
    first."""
    return float(np.sqrt(np.mean(np.maximum(np.abs(one.mean) - 2 * one.error, 0) ** 2)))


def _axis(trends: Sequence[Trend]) -> float:
    """Limit of the vertical axis of one chart. Each chart has its own, since the residuals of dark
    pixels would make all other trends look flat."""
    significant = [t.mean[np.abs(t.mean) > 2 * t.error] for t in trends]
    largest = max(float(np.abs(mean).max(initial=0.0)) for mean in significant)
    return next((step for step in STEPS if step >= largest), STEPS[-1])
