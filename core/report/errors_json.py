"""errors.json: how well photos are predicted (``predict``)."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..predict.errors import PhotoErrors
from ..views.prediction_pictures import DIFFERENCE_SCALE

FORMAT = 1


@dataclass(frozen=True)
class PredictedPhoto:
    """One photo of a prediction. fitted: whether the fit used it. flip: mean FLIP error, None if it
    was not computed. white: value that the pictures show as white."""

    name: str
    fitted: bool
    errors: PhotoErrors
    flip: float | None
    white: float


def describe(
    photos: Sequence[PredictedPhoto], capture: Path, result: Path, notes: Sequence[str]
) -> dict[str, Any]:
    """The content of errors.json: the errors of every photo, and their means over all photos, over
    those that the fit used (fitted) and over the others (held_out)."""
    return {
        "format": FORMAT,
        "capture": str(capture),
        "result": str(result),
        "overall": _mean(photos),
        "fitted": _mean([photo for photo in photos if photo.fitted]),
        "held_out": _mean([photo for photo in photos if not photo.fitted]),
        "photos": [
            {"name": p.name, "fitted": p.fitted, **_numbers(p.errors, p.flip), "white": p.white}
            for p in photos
        ],
        "difference_scale": DIFFERENCE_SCALE,
        "notes": list(notes),
    }


def write(path: Path, content: dict[str, Any]) -> None:
    """Write errors.json."""
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", "utf-8")


def _mean(photos: Sequence[PredictedPhoto]) -> dict[str, Any] | None:
    some = [photo for photo in photos if photo.errors.pixels]
    if not some:
        return None
    flips = [photo.flip for photo in some if photo.flip is not None]
    flip = sum(flips) / len(flips) if len(flips) == len(some) else None
    mean = PhotoErrors.mean([photo.errors for photo in some])
    return {"photos": len(some), **_numbers(mean, flip)}


def _numbers(errors: PhotoErrors, flip: float | None) -> dict[str, Any]:
    numbers = {
        "typical": errors.typical,
        "relative_rms": errors.relative_rms,
        "encoded_rmse": errors.encoded_rmse,
        "flip": flip,
    }
    known = {k: None if v is None or math.isnan(v) else v for k, v in numbers.items()}
    return {**known, "pixels": errors.pixels}
