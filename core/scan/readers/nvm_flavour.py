"""Who wrote an .nvm: VisualSFM and COLMAP mean different things by the same numbers.

VisualSFM counts pixels from the photo's centre, and its r straightens what was measured
(measured_radial_lens.py); COLMAP counts from the photo's corner and writes r = −k of its
SIMPLE_RADIAL. Nothing in the file says which: its own observations do.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..camera import Pose
from ..lens import make_lens
from ..lenses.measured_radial_lens import MODEL as MEASURED_RADIAL
from ..parsing.tracks import Tracks

Array = NDArray[np.float64]

ENOUGH = 8  # observations of a photo, to find its centre from
SAME_SIZE = 6  # pixels by which estimated sizes may differ and still be one


@dataclass(frozen=True)
class NvmModel:
    """One reconstruction of the file. values: (n, 10) numbers of each camera's line."""

    names: list[str]
    values: Array
    tracks: Tracks


@dataclass(frozen=True)
class NvmFlavour:
    """Who wrote the file.

    seen: some observations of each camera (the rows of Tracks.kept). centred: its pixels count from
    the photo's centre. measured: its r straightens what was measured (VisualSFM), else it is −k of
    COLMAP's SIMPLE_RADIAL.
    """

    model: NvmModel
    poses: list[Pose]
    seen: list[Array]
    fixed: list[float] | None
    centred: bool
    measured: bool

    @classmethod
    def of(
        cls,
        model: NvmModel,
        poses: list[Pose],
        sizes: list[tuple[int, int] | None],
        fixed: list[float] | None,
    ) -> NvmFlavour:
        """By the signs of the observations, and by which lens they fit better."""
        least = model.tracks.least
        kept = model.tracks.observations()
        kept = kept[np.argsort(kept[:, 0], kind="stable")]
        seen = np.split(kept, np.searchsorted(kept[:, 0], np.arange(1, len(poses))))
        centred = fixed is None and bool((least < 0).any())
        options = [cls(model, poses, seen, fixed, centred, measured) for measured in (True, False)]
        if fixed is not None or not model.values[:, 8].any():
            return options[0]
        misses = [option._miss(sizes) for option in options]
        if not np.isfinite(misses).any():
            return options[0 if centred or not np.isfinite(least).any() else 1]
        return options[int(np.nanargmin(misses))]

    def lens(self, camera: int, size: tuple[int, int]) -> tuple[str, tuple[float, ...]]:
        """(model, parameters) of a camera whose photo is this large."""
        centre = size[0] / 2, size[1] / 2
        if self.fixed is not None:
            fx, cx, fy, cy, *more = self.fixed
            if not more or more[0] == 0.0:
                return "PINHOLE", (fx, fy, cx, cy)
            if fx == fy:
                return MEASURED_RADIAL, (fx, cx, cy, more[0])
            raise InputError(
                "a fixed calibration with radial distortion and oblong pixels (fx is not fy) is "
                "not read: no lens model is exact",
                file="NVM_V3 FixedK",
            )
        f, r = float(self.model.values[camera, 0]), float(self.model.values[camera, 8])
        if r == 0.0:
            return "SIMPLE_PINHOLE", (f, *centre)
        if self.measured:
            return MEASURED_RADIAL, (f, *centre, r)
        return "SIMPLE_RADIAL", (f, *centre, -r)

    def estimated_sizes(self, path: Path) -> list[tuple[int, int]]:
        """A photo is as large as its features need; where these count from its corner, so large
        that its middle is where the file's own points and poses put it."""
        tracks = self.model.tracks
        with np.errstate(invalid="ignore"):
            reach: Array = 2.0 * np.maximum(np.abs(tracks.least), np.abs(tracks.most))
        if not self.centred:
            reach = tracks.most.copy()
            for camera in range(len(reach)):
                middle = self._middle(camera)
                if middle is not None:
                    reach[camera] = np.maximum(reach[camera], np.round(2 * middle))
        good = np.isfinite(reach).all(axis=1) & (reach > 0).all(axis=1) & (reach < 1e9).all(axis=1)
        if not good.all():
            name = self.model.names[int(np.argmin(good))]
            raise InputError(
                f"says neither how large the photo {name!r} is nor where a feature lies in it; "
                "give [scan] images",
                file=path,
            )
        common: Array = np.median(reach, axis=0)
        if not self.centred and (np.abs(reach - common) <= SAME_SIZE).all():
            reach = np.tile(common, (len(reach), 1))
        return [(int(w), int(h)) for w, h in np.ceil(reach)]

    def _middle(self, camera: int) -> Array | None:
        """(2,) where the pixels say that the lens looks, from a camera's own observations."""
        seen, straight = self._seen(camera)
        if len(seen) < ENOUGH:
            return None
        flat = make_lens(*self._about_zero(camera)).img_from_cam(straight)
        middle = np.median(seen - flat, axis=0)
        return middle if np.isfinite(middle).all() and (middle > 0).all() else None

    def _miss(self, sizes: list[tuple[int, int] | None]) -> float:
        """Mean distance in pixels between observations and projected points, each 20 at most."""
        misses = []
        for camera, size in enumerate(sizes):
            seen, straight = self._seen(camera)
            if len(seen) < ENOUGH:
                continue
            middle = self._middle(camera) if size is None else np.array(size, np.float64) / 2
            if self.centred:
                middle = np.zeros(2)
            if middle is None:
                continue
            flat = make_lens(*self._about_zero(camera)).img_from_cam(straight)
            off = np.linalg.norm(seen - middle - flat, axis=1)
            misses.append(np.minimum(np.nan_to_num(off, nan=20.0), 20.0))
        return float(np.concatenate(misses).mean()) if misses else np.nan

    def _about_zero(self, camera: int) -> tuple[str, int, int, tuple[float, ...]]:
        """make_lens's arguments for a lens whose principal point is at (0, 0)."""
        model, parameters = self.lens(camera, (0, 0))
        return model, 1, 1, parameters

    def _seen(self, camera: int) -> tuple[Array, Array]:
        """(pixels (n, 2), the points (n, 3) in the camera's frame) of some observations."""
        rows = self.seen[camera]
        pose = self.poses[camera]
        with np.errstate(all="ignore"):
            straight = rows[:, 3:] @ pose.rotation.T + pose.translation
            front = straight[:, 2] > 0
        return rows[front, 1:3], np.ascontiguousarray(straight[front])
