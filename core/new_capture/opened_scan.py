"""The scan of a draft, opened for matching."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..basis import default_basis
from ..geometry import RayScene
from ..light_search.brdf_dictionary import BrdfDictionary
from ..scan import Scan
from ..scan.scan import read_scan, with_extra_cameras
from .draft import Draft
from .photo_content import outline

CHECKED_CAMERAS = 12  # of the scan, for the mesh
CHECKED_SHAPE = (24, 32)  # pixels
MIN_SEEN_SHARE = 0.005  # of a camera's picture


@dataclass(frozen=True)
class OpenedScan:
    """scan: cameras and mesh in one frame; rays: of its mesh; dictionary: of materials."""

    scan: Scan
    rays: RayScene
    dictionary: BrdfDictionary


def opened_scan(draft: Draft) -> OpenedScan:
    """The scan of a draft with cameras and mesh. Raises PatinaError."""
    assert draft.cameras is not None and draft.mesh is not None  # the caller has both
    scan = read_scan(draft.cameras, draft.mesh, draft.images)
    if draft.extra is not None:
        scan = with_extra_cameras(scan, draft.extra)
    return OpenedScan(scan, RayScene.build(scan.mesh), BrdfDictionary.of(default_basis()))


def with_scan_checked(draft: Draft, opened: OpenedScan) -> Draft:
    """The draft with the labels of the cameras, and a sentence on whether they see the mesh."""
    cameras = opened.scan.cameras
    draft = replace(draft, camera_labels=tuple(camera.label for camera in cameras))
    places = np.linspace(0, len(cameras) - 1, min(len(cameras), CHECKED_CAMERAS))
    seen = [
        bool(outline(cameras[int(i)], CHECKED_SHAPE, opened.rays).mean() > MIN_SEEN_SHARE)
        for i in places
    ]
    share = f"{sum(seen)} of {len(seen)} cameras"
    if sum(seen) * 2 < len(seen):
        problem = (
            f"Only {share} see the mesh. Check that cameras and mesh are of one scan and were "
            "exported in one coordinate system"
        )
        return replace(draft, problems=(*draft.problems, problem))
    return replace(draft, found=(*draft.found, f"The mesh fits the cameras: {share} see it"))
