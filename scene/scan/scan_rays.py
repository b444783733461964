"""The scan of the capture in the scene, ready for rays, while Blender runs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...core.capture import Capture, read_capture
from ...core.errors import InputError
from ...core.geometry import RayScene
from ...core.inputs import capture_data
from ...core.masks.carry import SeenFaces
from ...core.scan import Scan
from ..session.session_state import Kept

KEPT = 4  # photos of which it is known what they show: of 24 megapixels 200 MB each


@dataclass(frozen=True)
class ScanRays:
    """Of one capture file as it was at ``changed``. seen: what each photo shows, by place, as far
    as it was asked for."""

    capture: Capture
    scan: Scan
    rays: RayScene
    changed: float
    seen: dict[int, SeenFaces]

    def faces_of(self, place: int) -> SeenFaces:
        """Which faces a photo shows where."""
        if place not in self.seen:
            while len(self.seen) >= KEPT:
                self.seen.pop(next(iter(self.seen)))
            camera = capture_data.camera_of(self.capture, self.scan, place)
            self.seen[place] = SeenFaces.of(self.rays, camera)
        return self.seen[place]


_last: Kept[ScanRays] = Kept()


def scan_rays(path: str) -> ScanRays:
    """Of a capture file; the last one is kept. Raises InputError."""
    file = Path(path)
    if not file.is_file():
        raise InputError("is gone; import the capture again from where it is now", file=file)
    changed, last = file.stat().st_mtime, _last.thing
    if last is None or last.capture.file != file or last.changed != changed:
        capture = read_capture(file)
        scan = capture_data.open_scan(capture)
        last = ScanRays(capture, scan, RayScene.build(scan.mesh), changed, {})
        _last.thing = last
    return last
