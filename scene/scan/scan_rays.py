"""The scene's scan with an acceleration structure for rays, kept while Blender runs."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.capture import Capture, read_capture
from ...core.geometry import RayScene
from ...core.inputs import capture_data
from ...core.masks.carry import VisibleFaces
from ...core.scan import Scan
from ..session.existing_capture import existing_capture
from ..session.session_state import KeptValue

MAX_PHOTOS = 4  # photos whose visible faces are cached; 200 MB each at 24 megapixels


@dataclass(frozen=True)
class ScanRays:
    """The scan of one capture file.

    changed: modification time of the file, seconds; seen: index of a photo → the faces it shows, a
    cache.
    """

    capture: Capture
    scan: Scan
    rays: RayScene
    changed: float
    seen: dict[int, VisibleFaces]

    def faces_of(self, place: int) -> VisibleFaces:
        """The face that each pixel of a photo shows; place: index of the photo."""
        if place not in self.seen:
            while len(self.seen) >= MAX_PHOTOS:
                self.seen.pop(next(iter(self.seen)))
            camera = capture_data.camera_of(self.capture, self.scan, place)
            self.seen[place] = VisibleFaces.of(self.rays, camera)
        return self.seen[place]


_last: KeptValue[ScanRays] = KeptValue()


def scan_rays(path: str) -> ScanRays:
    """The scan of a capture file; the last one is cached. Raises InputError if a file cannot be
    read."""
    file = existing_capture(path)
    changed, last = file.stat().st_mtime, _last.value
    if last is None or last.capture.file != file or last.changed != changed:
        capture = read_capture(file)
        scan = capture_data.open_scan(capture)
        last = ScanRays(capture, scan, RayScene.build(scan.mesh), changed, {})
        _last.value = last
    return last
