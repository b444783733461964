"""`run.py pictures`: render docs/images/diagnosis.jpg, the diagnosis of three hidden effects.

One row per effect, from left to right: a photo, its residual after the first fit, its residual with
the accepted cause in the model, and the change that this cause predicts.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from ..common import ROOT, say
from ..make_pictures import with_gaps, write

TARGET = ROOT / "docs" / "images" / "diagnosis.jpg"
SHOWN = (("cast_shadow", 2), ("near_light", 2), ("vignetting", 2))  # (cause, seed)
STRENGTH = 0.03
HEIGHT = 220

Array = np.ndarray


def make() -> None:
    """Make and diagnose the captures, and write the picture."""
    rows = []
    for cause, seed in SHOWN:
        with tempfile.TemporaryDirectory() as folder:
            rows.append(_row(Path(folder), cause, seed))
    width = max(row.shape[1] for row in rows)
    filled = [
        np.pad(r, ((0, 0), (0, width - r.shape[1]), (0, 0)), constant_values=255) for r in rows
    ]
    write(TARGET, with_gaps(filled, axis=0))
    print(f"wrote {TARGET}: {TARGET.stat().st_size / 1000:.0f} kB")


def _row(folder: Path, cause: str, seed: int) -> Array:
    from patina.core.capture import read_capture
    from patina.core.jobs import FitJob, finished
    from patina.core.jobs.diagnose_job import DiagnoseJob
    from patina.core.report.residual_picture import photo_most_changed, residual_picture
    from patina.core.views import display

    from .make import CAPTURE
    from .make import make as hide

    hide(folder, cause, STRENGTH, seed)
    job = DiagnoseJob(FitJob(read_capture(folder / CAPTURE), portable=False))
    job.drain()
    found, result = finished(job.found), finished(job.result)
    say(f"{cause}: {', '.join(found.causes) or 'none'}")
    trial, pixels = found.accepted[0], finished(job.context).pixels
    changed = trial.changed() / found.before.deviation
    photo = photo_most_changed(pixels, changed)
    assert photo is not None
    radiance = result.photos.read(photo).radiance
    white = display.white_level(radiance)
    box = display.crop_box(radiance.max(axis=2) > 0.002 * white, margin=2)
    after = found.after.residual * (found.after.deviation / found.before.deviation)
    cells = [
        display.photo_picture(radiance[box], white),
        *(residual_picture(pixels, r, photo) for r in (found.before.residual, after, -changed)),
    ]
    return with_gaps([_sized(cell) for cell in cells], axis=1)


def _sized(cell: Array) -> Array:
    """Resize to HEIGHT pixels with nearest-neighbour sampling."""
    rows = (np.arange(HEIGHT) + 0.5) * len(cell) / HEIGHT
    columns = np.arange(round(cell.shape[1] * HEIGHT / len(cell))) + 0.5
    return cell[rows.astype(int)][:, (columns * len(cell) / HEIGHT).astype(int)]
