"""Materials of faces that a program gives to a scan, in addition to those of its files."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scan import Scan


@dataclass(frozen=True)
class FaceSlots:
    """A face attribute to add to a scan. attribute: its name; slots: (f,) index of each face's
    material; mesh: name of the mesh that they come from, for errors."""

    attribute: str
    slots: NDArray[np.int32]
    mesh: str

    def __call__(self, scan: Scan) -> Scan:
        """The scan with the attribute. Raises InputError where its number of faces differs."""
        if len(scan.mesh.faces) != len(self.slots):
            raise InputError(
                f"{self.mesh} has {len(self.slots):,} faces, the scan has "
                f"{len(scan.mesh.faces):,}; import the capture again, or disable Fit These "
                "Materials"
            )
        attributes = {**scan.mesh.face_attributes, self.attribute: self.slots}
        return replace(scan, mesh=replace(scan.mesh, face_attributes=attributes))
