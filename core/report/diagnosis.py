"""diagnosis.json and the report's section: what the model gets wrong, and what helps."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ..diagnose import slack
from ..diagnose.coordinates import coordinates, trend
from ..diagnose.effect import Setting
from ..diagnose.fitted import Fitted
from ..diagnose.search import Found, Trial
from ..photo import write_png
from .page import page
from .residual_picture import residual_picture
from .result_json import program_version, write_json
from .trend_chart import trend_chart

FORMAT = 1
MOST_SHOWN = 6  # charts: those along which the residual changes most
STEPS = (0.05, 0.1, 0.2, 0.5, 1.0)  # of a chart's vertical axis


def describe(found: Found) -> dict[str, Any]:
    """The content of diagnosis.json. Costs are nats a pixel and channel; angles are radians."""
    tried = {t.effect.cause: t for trials in found.rounds for t in trials}
    return {
        "format": FORMAT,
        "program": {"name": "patina", "version": program_version()},
        "named": list(found.causes) or ["none"],
        "baseline": {"held_out": found.unseen_before.mean, "not_noise": found.not_noise_before},
        "extended": {"held_out": found.unseen_after.mean, "not_noise": found.not_noise_after},
        "causes": [_cause(t, t in found.accepted) for t in found.ranked],
        "left": {
            "named": found.unexplained,
            "gain": found.left.gain,
            "standard_error": found.left.error,
            "rms": found.left.change,
            "sentence": found.left.sentence(),
        },
        "coefficients": {
            "before": _coefficients(found.before),
            "after": _coefficients(found.after),
        },
        "tried": sorted(tried),
    }


def _coefficients(fitted: Fitted) -> list[Any]:
    """Of each material and channel, in the basis; the slack beside it is left out."""
    brdfs = fitted.model.brdfs
    return [c.round(6).tolist() for c in brdfs.coefficients[..., : -slack.COUNT]]


def write(path: Path, found: Found) -> None:
    """Write the file; it appears whole or not at all."""
    write_json(path, describe(found))


def _cause(trial: Trial, accepted: bool) -> dict[str, Any]:
    numbers = trial.effect.numbers
    return {
        "cause": trial.effect.cause,
        "accepted": accepted,
        "sentence": trial.sentence(),
        "ties": [effect.cause for effect in trial.ties],
        "held_out_gain": trial.gain,
        "standard_error": trial.error,
        "p_value": trial.chance,
        "rms_change": trial.change,
        "parameters": {
            name: {"value": float(v), "standard_error": float(d), "unit": unit}
            for name, unit, v, d in zip(
                numbers.names, numbers.units, trial.told, trial.deviation, strict=True
            )
        },
    }


def write_pages(folder: Path, name: str, found: Found, setting: Setting) -> Path:
    """index.html and pictures; name: the capture file's."""
    folder.mkdir(parents=True, exist_ok=True)
    html = page(name, section(found, setting) + _pictures(folder, found, setting))
    (folder / "index.html").write_text(html, "utf-8")
    return folder / "index.html"


def _pictures(folder: Path, found: Found, setting: Setting) -> str:
    """HTML: what each photo shows more than the prediction, before and after."""
    pixels, rows = setting.pixels, []
    fits = {"before": found.before, "after": found.after}
    if not found.accepted:
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
    what = "before and after" if found.accepted else "as it is"
    return (
        f"<h2>Where it is wrong, {what}</h2><p class='sub'><span class='key'></span> prediction "
        "too dark … too bright, full colour at three times what such a pixel usually misses.</p>"
        f"<div class='residuals'>{''.join(rows)}</div>"
    )


def section(found: Found, setting: Setting) -> str:
    """HTML: the ranking, then the residual along what betrays causes."""
    left = f"<p>{escape(found.left.sentence())}</p>" if found.unexplained else ""
    rows = "".join(_row(t, t in found.accepted, found) for t in found.ranked)
    named = ", ".join(found.causes) or "nothing that can be named"
    return (
        f"<h2>What is wrong</h2><p><b>{escape(named)}</b></p>{left}"
        f"<p class='sub'>{100 * found.not_noise_before:.0f} % of what the prediction misses is "
        f"neither noise nor the scan's known errors; with what is named in the model "
        f"{100 * found.not_noise_after:.0f} %. A gain is what the model with a cause predicts "
        "better of parts of the photos that it was not fitted to, in standard errors.</p>"
        f"<table><tr><th>cause</th><th>gain</th><th></th><th>what it would mean</th></tr>{rows}"
        f"</table><div class='charts'>{_charts(found, setting)}</div><p class='sub'>What the "
        "photos show more than the prediction, relative; red before, blue after; bars: two "
        "standard errors.</p>"
    )


def _row(trial: Trial, accepted: bool, found: Found) -> str:
    sure = trial.gain / max(trial.error, 1e-9)
    width = int(np.clip(12 * sure, 0, 160))
    said = trial.sentence() if accepted else ""
    style = "background:#2f6fb0" if accepted else "background:#bbb"
    return (
        f"<tr><th>{escape(trial.effect.cause)}</th><td>{sure:.1f}</td><td><div style='height:10px;"
        f"width:{width}px;{style}'></div></td><td>{escape(said)}</td></tr>"
    )


def _charts(found: Found, setting: Setting) -> str:
    drawn = []
    block = setting.pixels.block
    for coordinate in coordinates(setting):
        trends = []
        for fitted in (found.before, found.after):
            missed = setting.pixels.observed - fitted.shown
            trends.append(trend(coordinate, missed, fitted.shown, fitted.deviation, block))
        before = trends[0]
        if not len(before.at):
            continue
        size = float(np.sqrt(np.mean(before.mean**2)))
        drawn.append((size, coordinate, trends))
    drawn.sort(key=lambda d: -d[0])
    chosen = drawn[:MOST_SHOWN]
    largest = max((float(np.abs(t.mean).max()) for _, _, ts in chosen for t in ts), default=0.05)
    most = next((s for s in STEPS if s >= largest), STEPS[-1])
    return "".join(
        f"<figure>{trend_chart(c.name, c.unit, ts[0], ts[1] if found.accepted else None, most)}"
        "</figure>"
        for _, c, ts in chosen
    )
