"""Predict the photos of a capture from a result folder, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from ..capture import Capture, read_capture
from ..concurrency.job import Job, Step
from ..concurrency.steps import relayed
from ..errors import InputError
from ..result import FittedResult
from .fitted_scene import scene_of_result
from .photo_prediction import PhotoPrediction, inputs_from, predict_one

OPENED = 0.2  # fraction of the job's time after which photos are predicted


class PredictJob(Job):
    """Predict every photo of a capture. ``take`` gets each prediction when it is done, so that only
    one is in memory.

    capture: with photos that the fit may have seen or not. result: of a fit of this capture, or of
    another one with the same mesh: the file that the result names, where it still exists. fitted:
    that capture, known once the job runs; ``notes``: sentences for the user.
    """

    def __init__(
        self,
        capture: Capture,
        result: FittedResult,
        take: Callable[[PhotoPrediction], None],
        threads: int | None = None,
    ) -> None:
        super().__init__()
        self.capture, self.result, self.take, self.threads = capture, result, take, threads
        self.fitted: Capture | None = None
        self.notes: tuple[str, ...] = ()

    def run(self) -> Iterator[Step]:
        """Open the fitted capture, then predict one photo after the other."""
        self.fitted, self.notes = fitted_capture(self.capture, self.result)
        scene = yield from relayed(
            scene_of_result(self.fitted, self.result, self.threads),
            lambda step: Step(step.stage, OPENED * step.fraction),
        )
        given = inputs_from(self.capture, scene)
        for place in range(len(self.capture.photos)):
            found = yield from relayed(predict_one(given, place), partial(self._step, place))
            self.take(found)

    def _step(self, place: int, done: float) -> Step:
        fraction = OPENED + (1 - OPENED) * (place + done) / len(self.capture.photos)
        return Step(f"predicting {self.capture.photo_name(place)}", fraction)

    def is_fitted(self, place: int) -> bool:
        """Whether the fit used a photo of the capture, by its files."""
        assert self.fitted is not None
        used = {file.resolve() for photo in self.fitted.photos for file in photo.files}
        return any(file.resolve() in used for file in self.capture.photos[place].files)


def fitted_capture(capture: Capture, result: FittedResult) -> tuple[Capture, tuple[str, ...]]:
    """(the capture that a result was fitted to, notes). It is ``capture`` itself where the result
    names the same file, or one that is no longer there."""
    if not result.capture:
        return capture, ()
    file = Path(result.capture)
    try:
        if file.resolve() == capture.file.resolve():
            return capture, ()
        return read_capture(file), ()
    except (InputError, OSError):
        return capture, (
            f"The capture file of the fit ({file.name}) cannot be read. All photos are assumed to "
            "be in its unit, and to be photos that the fit used.",
        )
