"""The result of solving a folder of photos, and its files."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path

import pycolmap

from ..counted import counted
from ..errors import PatinaError

MODEL = "sparse"
REPORT = "report.txt"
MAX_LISTED = 200  # names per list in the report


@dataclass(frozen=True)
class Unplaced:
    """A photo without a pose. others: number of photos with verified matches; points: total number
    of matched points."""

    name: str
    others: int
    points: int

    @property
    def why(self) -> str:
        """The reason, as a clause."""
        if not self.others:
            return "no matches with any other photo"
        points, others = counted(self.points, "point"), counted(self.others, "photo")
        return f"{points} match {others}: too few, or ambiguous"


@dataclass(frozen=True)
class Solution:
    """model: COLMAP's model; its images are named by the photos' paths in their folder; photos:
    number of photos; unplaced; unreadable: (name, reason); others: names of the photos in each
    smaller, separate model."""

    model: pycolmap.Reconstruction
    photos: int
    unplaced: tuple[Unplaced, ...] = ()
    unreadable: tuple[tuple[str, str], ...] = ()
    others: tuple[tuple[str, ...], ...] = ()

    @property
    def placed(self) -> int:
        """Number of photos with a pose."""
        return int(self.model.num_reg_images())

    @property
    def error(self) -> float:
        """Mean reprojection error, pixels."""
        return float(self.model.compute_mean_reprojection_error())

    def summary(self) -> str:
        """A summary in one line."""
        return (
            f"{self.placed} of {self.photos} photos placed, {self.model.num_points3D():,} points, "
            f"mean reprojection error {self.error:.2f} pixels"
        )

    def report(self) -> str:
        """The full report as text."""
        lines = [self.summary(), "", "Lenses"]
        for camera in self.model.cameras.values():
            used = sum(
                image.camera_id == camera.camera_id and image.has_pose
                for image in self.model.images.values()
            )
            parameters = ", ".join(
                f"{name.strip()} {value:.5g}"
                for name, value in zip(camera.params_info.split(","), camera.params, strict=False)
            )
            lines.append(
                f"  {counted(used, 'photo')} of {camera.width} x {camera.height}: "
                f"{camera.model.name} {parameters}"
            )
        _list(lines, "Photos without a pose", [f"{u.name}: {u.why}" for u in self.unplaced])
        _list(lines, "Unreadable photos", [why for _, why in self.unreadable])
        for names in self.others:
            _list(lines, "Separate group of photos, not connected to the others", list(names))
        return "\n".join(lines) + "\n"

    def write(self, folder: Path, final: Path, photos: Path) -> Path:
        """Write sparse/, a capture file to continue from and the report into ``folder``, which will
        be moved to ``final``. photos: their folder. Returns the path of the capture file."""
        sparse = folder / MODEL
        sparse.mkdir(exist_ok=True)
        try:
            self.model.write(sparse)
            (folder / REPORT).write_text(self.report(), "utf-8")
            name = photos.resolve().name or "photos"
            capture = folder / f"{name}.capture.toml"
            capture.write_text(starter_capture(_relative_path(final, photos)), "utf-8")
        except (OSError, RuntimeError, ValueError) as error:
            raise PatinaError(f"{final}: cannot be written ({error})") from error
        return capture


def _list(lines: list[str], title: str, entries: list[str]) -> None:
    if entries:
        lines += [
            "",
            f"{title} ({len(entries)})",
            *(f"  {entry}" for entry in entries[:MAX_LISTED]),
        ]
    if len(entries) > MAX_LISTED:
        lines.append(f"  … and {len(entries) - MAX_LISTED} more")


def _relative_path(final: Path, photos: Path) -> str:
    """Path of the photos relative to the capture file."""
    target = photos.resolve()
    try:
        return Path(os.path.relpath(target, final.resolve())).as_posix()
    except ValueError:  # on another drive
        return target.as_posix()


def starter_capture(images: str) -> str:
    """A capture file with the scan's part filled in and the rest explained."""
    return f"""\
# Written by `solve`. Still missing: a mesh, and at least one lit photo.

[scan]
cameras = "{MODEL}"
mesh = "model.ply"                 # made by dense reconstruction, see docs/guide/solve.md
images = {json.dumps(images, ensure_ascii=False)}

# One lamp; direction: from the surface to the lamp:
# [[light]]
# name = "lamp"
# direction = [0.3, 0.5, 0.81]

# One entry for every lit photo. For a photo that shares no viewpoint with a scan photo,
# `localise` computes a camera:
# [[photo]]
# file = "lit/0001.exr"
# camera = "IMG_0041.jpg"
# light = "lamp"
"""
