"""Mesh and cameras together, in the frame the reconstruction tool gave them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import InputError
from .camera import Camera
from .colmap import Points, is_colmap, read_colmap, read_colmap_with_points
from .mesh import Mesh, read_mesh


@dataclass(frozen=True)
class Scan:
    """A scanned object: its mesh, the cameras that saw it, where its own photos lie (if known)."""

    mesh: Mesh
    cameras: tuple[Camera, ...]
    images: Path | None = None

    def camera(self, label: str) -> Camera | None:
        """The camera of that label; a label is also found without its folder and extension
        (COLMAP says "IMG_0041.jpg", Metashape "IMG_0041") where that is unambiguous."""
        for camera in self.cameras:
            if camera.label == label:
                return camera
        same = [c for c in self.cameras if Path(c.label).stem == Path(label).stem]
        return same[0] if len(same) == 1 else None


def read_cameras(path: Path) -> tuple[Camera, ...]:
    """The cameras of any model Patina reads. Raises InputError."""
    return read_colmap(_colmap_folder(path))


def read_reconstruction(path: Path) -> tuple[tuple[Camera, ...], Points]:
    """Cameras and sparse points of a model that has no mesh yet. Raises InputError."""
    return read_colmap_with_points(_colmap_folder(path))


def _colmap_folder(path: Path) -> Path:
    if not path.is_dir():
        raise InputError("cameras of this kind are not read; expected a COLMAP folder", file=path)
    if is_colmap(path):
        return path
    near = [p for p in (path / "sparse" / "0", path / "sparse", path / "0") if is_colmap(p)]
    hint = f"; there is one in {near[0].relative_to(path)}" if near else ""
    raise InputError(f"the folder holds no COLMAP model (cameras and images){hint}", file=path)


def read_scan(cameras: Path, mesh: Path, images: Path | None = None) -> Scan:
    """Mesh and cameras from files, checked to be in one frame. Raises InputError."""
    scan = Scan(read_mesh(mesh), read_cameras(cameras), images)
    check_common_frame(scan, mesh)
    return scan


def check_common_frame(scan: Scan, mesh_file: Path) -> None:
    """Refuse a mesh that no camera sees: it was exported in another frame than the cameras."""
    vertices = scan.mesh.vertices
    some = vertices[:: max(1, len(vertices) // 2000)]
    for camera in scan.cameras:
        pixels = camera.project(some)
        with np.errstate(invalid="ignore"):
            inside = (pixels >= 0) & (pixels < (camera.width, camera.height))
        if inside.all(axis=1).any():
            return
    raise InputError(
        "the mesh lies in another frame than the cameras: no vertex projects into any photo; "
        "export mesh and cameras from the same project, without a transform of its own",
        file=mesh_file,
        key="scan.mesh",
    )
