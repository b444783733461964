"""Mesh and cameras together, in one frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .camera import Camera
from .formats import read_reconstruction
from .mesh import Mesh, read_mesh
from .reconstruction import Georeference, Reconstruction

VISIBILITY_SAMPLES = 2000  # vertices tested for visibility in the cameras
MIN_FRAME_GAIN = 1.2  # ratio of visible mesh fractions above which another frame is chosen


@dataclass(frozen=True)
class Scan:
    """A scanned object: mesh and cameras in one frame. images: folder of the scan's own photos (if
    known). georeference: location on Earth (if known). notes: what the readers left out or assumed.
    """

    STORED_APART: ClassVar[bool] = True

    mesh: Mesh
    cameras: tuple[Camera, ...]
    images: Path | None = None
    georeference: Georeference | None = None
    notes: tuple[str, ...] = ()

    def camera(self, label: str) -> Camera | None:
        """The camera with that label. A label also matches without folder and extension (COLMAP
        writes "IMG_0041.jpg", Metashape "IMG_0041") where that is unambiguous."""
        return find_camera(self.cameras, label)


def find_camera(cameras: Sequence[Camera], label: str) -> Camera | None:
    """The camera with that label, or the only one whose label is equal apart from folder and
    extension."""
    for camera in cameras:
        if camera.label == label:
            return camera
    same = [c for c in cameras if _stem(c.label) == _stem(label)]
    return same[0] if len(same) == 1 else None


def _stem(label: str) -> str:
    name = PurePosixPath(label.replace("\\", "/")).name
    head, dot, tail = name.rpartition(".")
    # "IMG.0041" has no extension
    return head if dot and tail.isalnum() and not tail.isdigit() and len(tail) <= 4 else name


def read_scan(
    cameras: Path,
    mesh: Path,
    images: Path | None = None,
    chunk: str | None = None,
    frame: str | None = None,
) -> Scan:
    """Read mesh and cameras and transform the cameras to the mesh's frame. Raises InputError.

    frame: name of the frame the mesh was exported in, where the reconstruction has several; without
    it, the frame in which the cameras see most of the mesh.
    """
    reconstruction = read_reconstruction(cameras, images, chunk)
    surface = read_mesh(mesh)
    found, note = _in_common_frame(reconstruction, surface, mesh, frame)
    notes = (*reconstruction.notes, *surface.notes, *((note,) if note else ()))
    return Scan(surface, found.cameras, images, found.georeference, notes)


def with_extra_cameras(scan: Scan, file: Path) -> Scan:
    """The scan with the cameras of another file in its frame, from photos that were localised
    later. Raises InputError where a label exists already."""
    extra = read_reconstruction(file)
    known_labels = {camera.label for camera in scan.cameras}
    for camera in extra.cameras:
        if camera.label in known_labels:
            raise InputError(
                f"the scan has a camera {camera.label!r} already; rename the photo", file=file
            )
    cameras = sorted((*scan.cameras, *extra.cameras), key=lambda camera: camera.label)
    return replace(scan, cameras=tuple(cameras), notes=(*scan.notes, *extra.notes))


def _in_common_frame(
    reconstruction: Reconstruction, mesh: Mesh, mesh_file: Path, frame: str | None
) -> tuple[Reconstruction, str | None]:
    """(the reconstruction in the mesh's frame, a note where that was not its own frame)."""
    if frame is not None and frame != "cameras":
        if frame not in reconstruction.frames:
            known = ", ".join(["cameras", *reconstruction.frames])
            raise InputError(
                f"found no frame {frame!r} in the scan; expected one of {known}", key="scan.frame"
            )
        moved = reconstruction.moved(frame)
        check_common_frame(moved.cameras, mesh, mesh_file)
        return moved, None
    own = seen_fraction(reconstruction.cameras, mesh)
    if frame is None:
        others = {name: reconstruction.moved(name) for name in reconstruction.frames}
        shares = {name: seen_fraction(other.cameras, mesh) for name, other in others.items()}
        best = max(shares, key=lambda name: shares[name], default=None)
        if best is not None and shares[best] > MIN_FRAME_GAIN * own:
            return others[best], f"The mesh is in the frame {best!r} of the scan."
    check_common_frame(reconstruction.cameras, mesh, mesh_file)
    return reconstruction, None


def seen_fraction(cameras: Sequence[Camera], mesh: Mesh) -> float:
    """Mean fraction of the mesh's vertices that project into a camera's photo."""
    vertices = _some_vertices(mesh)
    camera_sample = cameras[:: max(1, len(cameras) // 50)]
    return float(np.mean([_inside(camera, vertices).mean() for camera in camera_sample]))


def check_common_frame(cameras: Sequence[Camera], mesh: Mesh, mesh_file: Path) -> None:
    """Raise InputError where no camera sees the mesh: it was exported in another frame."""
    vertices = _some_vertices(mesh)
    if any(_inside(camera, vertices).any() for camera in cameras):
        return
    raise InputError(
        "the mesh is not in the frame of the cameras: no vertex projects into any photo; "
        "export mesh and cameras from the same project, without an additional transform",
        file=mesh_file,
        key="scan.mesh",
    )


def _some_vertices(mesh: Mesh) -> NDArray[np.float64]:
    return mesh.vertices[:: max(1, len(mesh.vertices) // VISIBILITY_SAMPLES)]


def _inside(camera: Camera, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    pixels = camera.project(points)
    with np.errstate(invalid="ignore"):
        inside: NDArray[np.bool_] = (pixels >= 0) & (pixels < (camera.width, camera.height))
    return np.asarray(inside.all(axis=1))
