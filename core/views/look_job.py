"""Looking at one photo, as a job that Blender steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..concurrency.job import Job, Step
from ..concurrency.steps import relayed
from ..geometry import RayScene
from ..inputs import capture_data
from ..inputs.lights import find_lights, refined
from ..inputs.photos import LitPhotos
from ..jobs import CaptureResult
from ..scan import Scan
from .photo_view import Fitted, PhotoView, look_at_photo


class LookJob(Job):
    """``view`` is there when the job is done.

    known: the fit that found ``fitted``, where it is still there: its scan, lights and photos are
    used again. prepare: what is done to the scan once it is read. chosen: (column, row) of pixels
    of this photo that a fit rests on.
    """

    def __init__(
        self,
        capture: Capture,
        fitted: Sequence[Fitted],
        place: int,
        prepare: Callable[[Scan], Scan] | None = None,
        known: CaptureResult | None = None,
        chosen: Sequence[tuple[int, int]] = (),
    ) -> None:
        super().__init__()
        self.capture = capture if known is None else known.capture
        self.fitted, self.place, self.prepare = fitted, place, prepare
        self.known, self.chosen = known, chosen
        self.view: PhotoView | None = None

    def run(self) -> Iterator[Step]:
        """The scan and the lights where they are not known, then the photo."""
        capture, known = self.capture, self.known
        start = 0.0
        if known is not None:
            scan, rays, photos, lights = known.scan, known.rays, known.photos, known.lights
        else:
            yield Step("reading the scan", 0.0)
            scan = capture_data.open_scan(capture)
            if self.prepare is not None:
                scan = self.prepare(scan)
            capture_data.check_face_attributes(capture, scan)
            yield Step("reading the scan", 0.2)
            rays, photos = RayScene.build(scan.mesh), LitPhotos.open(capture)
            lights, start = find_lights(capture, scan, photos), 0.3
            if any(entry.refine for entry in capture.lights):
                basis = self.fitted[0][1].basis
                lights = yield from relayed(
                    refined(lights, capture, scan, photos, rays, basis),
                    lambda done: Step("refining the lights", 0.3 + 0.4 * done),
                )
                start = 0.7
        used = self._used(capture_data.camera_of(capture, scan, self.place).width)
        self.view = yield from relayed(
            look_at_photo(capture, scan, rays, photos, lights, self.fitted, self.place, used),
            lambda done: Step("looking at the photo", start + (1 - start) * done),
        )

    def _used(self, width: int) -> NDArray[np.int64] | None:
        """Flat indices."""
        if not self.chosen:
            return None
        column, row = np.array(self.chosen, np.int64).T
        return row * width + column
