"""What solving a folder of photos found, and the files that say so."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path

import pycolmap

from ..errors import PatinaError

MODEL = "sparse"
REPORT = "report.txt"
LISTED = 200  # names in a report, of each kind


@dataclass(frozen=True)
class Unplaced:
    """A photo without a pose. others: how many photos it agrees with; points: in how many points,
    all in all."""

    name: str
    others: int
    points: int

    @property
    def why(self) -> str:
        """One clause."""
        if not self.others:
            return "shows nothing that another photo shows"
        return f"shares {self.points} points with {self.others} photos: too few, or ambiguous"


@dataclass(frozen=True)
class Solution:
    """model: COLMAP's, its images named by the photos' paths in their folder; photos: how many
    there were; unplaced; unreadable: (name, why); others: names in each smaller model that hangs
    together in itself, but not with the largest."""

    model: pycolmap.Reconstruction
    photos: int
    unplaced: tuple[Unplaced, ...] = ()
    unreadable: tuple[tuple[str, str], ...] = ()
    others: tuple[tuple[str, ...], ...] = ()

    @property
    def placed(self) -> int:
        """How many photos have a pose."""
        return int(self.model.num_reg_images())

    @property
    def error(self) -> float:
        """Mean reprojection error, pixels."""
        return float(self.model.compute_mean_reprojection_error())

    def summary(self) -> str:
        """One line."""
        return (
            f"{self.placed} of {self.photos} photos placed, {self.model.num_points3D():,} points, "
            f"reprojection error {self.error:.2f} pixels"
        )

    def report(self) -> str:
        """All of it as text."""
        lines = [self.summary(), "", "lenses"]
        for camera in self.model.cameras.values():
            used = sum(
                image.camera_id == camera.camera_id and image.has_pose
                for image in self.model.images.values()
            )
            numbers = ", ".join(
                f"{name.strip()} {value:.5g}"
                for name, value in zip(camera.params_info.split(","), camera.params, strict=False)
            )
            lines.append(
                f"  {used} photos of {camera.width} x {camera.height}: {camera.model.name} "
                f"{numbers}"
            )
        _list(lines, "without a pose", [f"{u.name}: {u.why}" for u in self.unplaced])
        _list(lines, "not readable", [why for _, why in self.unreadable])
        for names in self.others:
            _list(lines, "hang together, but not with the rest", list(names))
        return "\n".join(lines) + "\n"

    def write(self, folder: Path, final: Path, photos: Path) -> Path:
        """sparse/, a capture file to go on from and the report, into ``folder``, which will be
        moved to ``final``. photos: the folder they lie in. Returns the capture file's path."""
        sparse = folder / MODEL
        sparse.mkdir(exist_ok=True)
        try:
            self.model.write(sparse)
            (folder / REPORT).write_text(self.report(), "utf-8")
            name = photos.resolve().name or "photos"
            capture = folder / f"{name}.capture.toml"
            capture.write_text(starter_capture(_between(final, photos)), "utf-8")
        except (OSError, RuntimeError, ValueError) as error:
            raise PatinaError(f"{final}: cannot be written ({error})") from error
        return capture


def _list(lines: list[str], title: str, entries: list[str]) -> None:
    if entries:
        lines += ["", f"{title} ({len(entries)})", *(f"  {entry}" for entry in entries[:LISTED])]
    if len(entries) > LISTED:
        lines.append(f"  … and {len(entries) - LISTED} more")


def _between(final: Path, photos: Path) -> str:
    """Where the photos lie, seen from the capture file."""
    target = photos.resolve()
    try:
        return Path(os.path.relpath(target, final.resolve())).as_posix()
    except ValueError:  # on another drive
        return target.as_posix()


def starter_capture(images: str) -> str:
    """A capture file with the scan's part filled in and the rest explained."""
    return f"""\
# Written by `solve`. What is still missing: a mesh, and at least one lit photo.

[scan]
cameras = "{MODEL}"
mesh = "model.ply"                 # dense reconstruction makes it: docs/guide/solve.md says how
images = {json.dumps(images, ensure_ascii=False)}

# One lamp, and which way it is from the surface:
# [[light]]
# name = "lamp"
# direction = [0.3, 0.5, 0.81]

# One of these for every lit photo; a photo that shares no viewpoint with a scan photo is given
# a camera by `localise`:
# [[photo]]
# file = "lit/0001.exr"
# camera = "IMG_0041.jpg"
# light = "lamp"
"""
