"""The material of each face of the mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..inputs.material_pixels import face_attribute
from ..samples.face_votes import FaceVotes
from ..scan import Scan


def face_materials(capture: Capture, scan: Scan, votes: FaceVotes) -> NDArray[np.int32]:
    """(f,) material of each face: by votes of the masked pixels; face attributes override."""
    found = votes.winners(scan.mesh)
    for index, material in enumerate(capture.materials):
        attribute = face_attribute(material)
        if attribute is not None:
            found[scan.mesh.face_attributes[attribute] == index] = index
    return found
