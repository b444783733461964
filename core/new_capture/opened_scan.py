"""The scan of a draft, opened for matching."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..basis import default_basis
from ..errors import PatinaError
from ..geometry import RayScene
from ..light_search.brdf_dictionary import BrdfDictionary
from ..scan import Scan
from ..scan.scan import read_scan
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


def opened_scan(draft: Draft) -> tuple[OpenedScan | None, Draft]:
    """(the scan, None if it cannot be read; the draft with what was found about it)."""
    assert draft.cameras is not None and draft.mesh is not None  # the caller has both
    try:
        scan = read_scan(draft.cameras, draft.mesh, draft.images)
    except PatinaError as error:
        return None, replace(draft, problems=(*draft.problems, str(error)))
    draft = replace(draft, camera_labels=tuple(camera.label for camera in scan.cameras))
    rays = RayScene.build(scan.mesh)
    places = np.linspace(0, len(scan.cameras) - 1, min(len(scan.cameras), CHECKED_CAMERAS))
    seen = [
        bool(outline(scan.cameras[int(i)], CHECKED_SHAPE, rays).mean() > MIN_SEEN_SHARE)
        for i in places
    ]
    opened = OpenedScan(scan, rays, BrdfDictionary.of(default_basis()))
    share = f"{sum(seen)} of {len(seen)} cameras"
    if sum(seen) * 2 < len(seen):
        problem = (
            f"Only {share} see the mesh. Check that cameras and mesh are of one scan and were "
            "exported in one coordinate system"
        )
        return opened, replace(draft, problems=(*draft.problems, problem))
    return opened, replace(
        draft, found=(*draft.found, f"The mesh fits the cameras: {share} see it")
    )
