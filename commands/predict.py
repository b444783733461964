"""``predict CAPTURE RESULT --out DIR``: what each photo of a capture should show."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..core.capture import read_capture
from ..core.counted import counted
from ..core.jobs.displaced_lights import not_applied
from ..core.jobs.photo_prediction import PhotoPrediction
from ..core.jobs.predict_job import PredictJob
from ..core.output_folder import check_out, staged_folder
from ..core.photo.image import write_png
from ..core.predict.flip import MISSING, flip_available
from ..core.report import errors_json
from ..core.report.errors_json import PredictedPhoto
from ..core.result import FittedResult, read_result
from ..core.views.prediction_pictures import PredictionPictures
from . import capture_arguments
from .progress import Progress, print_note
from .solve import check_threads

HELP = "predict the photos of a capture from a result, and compare them"
ASSUMED = "Light is direct, with cast shadows. Nothing was estimated from the predicted photos."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("capture", type=Path, help="the capture file (*.capture.toml)")
    parser.add_argument("result", type=Path, help="the output folder of `fit`, or its result.json")
    parser.add_argument("--out", type=Path, required=True, help="folder for pictures and errors")
    capture_arguments.add_threads(parser)


def run(arguments: argparse.Namespace) -> None:
    check_threads(arguments.threads)
    out = check_out(arguments.out)
    capture, result = read_capture(arguments.capture), read_result(arguments.result)
    with staged_folder(out, "predict", print_note) as folder:
        photos: list[PredictedPhoto] = []

        def take(found: PhotoPrediction) -> None:
            pictures = PredictionPictures.of(found)
            name = f"photo_{found.place + 1:02d}"
            for kind in ("photo", "prediction", "difference"):
                write_png(folder / f"{name}_{kind}.png", getattr(pictures, kind))
            flip = pictures.flip(found.compared)
            fitted = job.is_fitted(found.place)
            photos.append(PredictedPhoto(found.name, fitted, found.errors, flip, pictures.white))

        job = PredictJob(capture, result, take, arguments.threads)
        job.drain(Progress())
        notes = (ASSUMED, *_effects_note(result), *job.notes)
        notes += () if flip_available() else (MISSING,)
        content = errors_json.describe(photos, capture.file, result.file, notes)
        errors_json.write(folder / "errors.json", content)
    _print_summary(content)
    for note in notes:
        print_note(note)
    print(f"wrote {3 * len(photos)} pictures and {out / 'errors.json'}")


def _effects_note(result: FittedResult) -> tuple[str, ...]:
    causes = not_applied(result.effects)
    if not causes:
        return ()
    return (
        f"The result takes {', '.join(causes)} into account, which the prediction does not "
        "contain. Its errors are therefore too large.",
    )


def _print_summary(content: dict[str, Any]) -> None:
    for photo in content["photos"]:
        kind = "fitted" if photo["fitted"] else "held out"
        print(f"{Path(photo['name']).name} ({kind}): {_sentence(photo)}")
    for key, words in (("fitted", "fitted photo"), ("held_out", "held-out photo")):
        if content[key] is not None:
            count = counted(content[key]["photos"], words)
            print(f"mean of {count}: {_sentence(content[key])}")


def _sentence(errors: dict[str, Any]) -> str:
    if errors["typical"] is None:
        return "no pixel can be compared"
    flip = "" if errors["flip"] is None else f", FLIP {errors['flip']:.3f}"
    return (
        f"typical error {100 * errors['typical']:.1f} %, relative RMS "
        f"{100 * errors['relative_rms']:.1f} %, RMSE {errors['encoded_rmse']:.3f}{flip} "
        f"({errors['pixels']:,} pixels)"
    )
