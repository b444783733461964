"""The comparison of one photo with its prediction, as a job that Blender runs in steps."""

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
    """Compute the PhotoView of one photo; ``view`` holds it when the job is done.

    fitted: the materials; known: the fit that they come from, if it is still in memory, whose scan,
    lights and photos are then reused. prepare: applied to the scan after reading. chosen: (column,
    row) of the pixels of this photo that the fit uses.
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
        """Read the scan and the lights if necessary, then compare the photo."""
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
            look_at_photo(
                capture,
                scan,
                rays,
                photos,
                lights,
                self.fitted,
                self.place,
                used,
                None if known is None else known.varying,
            ),
            lambda done: Step(
                "comparing the photo with its prediction", start + (1 - start) * done
            ),
        )

    def _used(self, width: int) -> NDArray[np.int64] | None:
        """(k,) flat pixel indices of ``chosen`` in a photo of this width."""
        if not self.chosen:
            return None
        column, row = np.array(self.chosen, np.int64).T
        return row * width + column
