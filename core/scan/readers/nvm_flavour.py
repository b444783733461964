"""Find out which tool wrote an .nvm: VisualSFM and COLMAP give the same numbers different meanings.

VisualSFM counts pixels from the photo's centre, and its r undistorts measured pixels
(measured_radial_lens.py). COLMAP counts from the photo's corner and writes r = −k of its
SIMPLE_RADIAL. The file does not name its tool; the decision uses its observations.
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

MIN_OBSERVATIONS = 8  # observations of a photo, to estimate its centre
SIZE_TOLERANCE = 6  # pixels; estimated sizes that differ by less are treated as equal


@dataclass(frozen=True)
class NvmModel:
    """One reconstruction of the file. values: (n, 10) the values of each camera's line."""

    names: list[str]
    values: Array
    tracks: Tracks


@dataclass(frozen=True)
class NvmFlavour:
    """Conventions of the tool that wrote the file.

    seen: some observations of each camera (rows of Tracks.kept). centred: whether pixels count from
    the photo's centre. measured: True where r undistorts measured pixels (VisualSFM), False where
    it is −k of COLMAP's SIMPLE_RADIAL.
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
        """Decide by the signs of the observations, and by the lens with the smaller reprojection
        error."""
        least = model.tracks.least
        kept = model.tracks.observations()
        kept = kept[np.argsort(kept[:, 0], kind="stable")]
        seen = np.split(kept, np.searchsorted(kept[:, 0], np.arange(1, len(poses))))
        centred = fixed is None and bool((least < 0).any())
        options = [cls(model, poses, seen, fixed, centred, measured) for measured in (True, False)]
        if fixed is not None or not model.values[:, 8].any():
            return options[0]
        errors = [option._reprojection_error(sizes) for option in options]
        if not np.isfinite(errors).any():
            return options[0 if centred or not np.isfinite(least).any() else 1]
        return options[int(np.nanargmin(errors))]

    def lens(self, camera: int, size: tuple[int, int]) -> tuple[str, tuple[float, ...]]:
        """(model, parameters) of a camera whose photo has this size."""
        centre = size[0] / 2, size[1] / 2
        if self.fixed is not None:
            fx, cx, fy, cy, *more = self.fixed
            if not more or more[0] == 0.0:
                return "PINHOLE", (fx, fy, cx, cy)
            if fx == fy:
                return MEASURED_RADIAL, (fx, cx, cy, more[0])
            raise InputError(
                "a fixed calibration with radial distortion and non-square pixels (fx "
                "differs from fy) "
                "is not supported: no lens model is exact",
                file="NVM_V3 FixedK",
            )
        f, r = float(self.model.values[camera, 0]), float(self.model.values[camera, 8])
        if r == 0.0:
            return "SIMPLE_PINHOLE", (f, *centre)
        if self.measured:
            return MEASURED_RADIAL, (f, *centre, r)
        return "SIMPLE_RADIAL", (f, *centre, -r)

    def estimated_sizes(self, path: Path) -> list[tuple[int, int]]:
        """(width, height) of each photo: the smallest that holds its features. Where pixels count
        from the corner, the size also puts the photo's centre where the file's points and poses
        imply it."""
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
                f"holds neither the size of the photo {name!r} nor a feature in it; "
                "set [scan] images to the folder of the photos",
                file=path,
            )
        common: Array = np.median(reach, axis=0)
        if not self.centred and (np.abs(reach - common) <= SIZE_TOLERANCE).all():
            reach = np.tile(common, (len(reach), 1))
        return [(int(w), int(h)) for w, h in np.ceil(reach)]

    def _middle(self, camera: int) -> Array | None:
        """(2,) the principal point in pixels, estimated from a camera's own observations."""
        seen, straight = self._seen(camera)
        if len(seen) < MIN_OBSERVATIONS:
            return None
        flat = make_lens(*self._about_zero(camera)).img_from_cam(straight)
        middle = np.median(seen - flat, axis=0)
        return middle if np.isfinite(middle).all() and (middle > 0).all() else None

    def _reprojection_error(self, sizes: list[tuple[int, int] | None]) -> float:
        """Mean distance in pixels between observations and projected points, each clipped to 20."""
        errors = []
        for camera, size in enumerate(sizes):
            seen, straight = self._seen(camera)
            if len(seen) < MIN_OBSERVATIONS:
                continue
            middle = self._middle(camera) if size is None else np.array(size, np.float64) / 2
            if self.centred:
                middle = np.zeros(2)
            if middle is None:
                continue
            flat = make_lens(*self._about_zero(camera)).img_from_cam(straight)
            off = np.linalg.norm(seen - middle - flat, axis=1)
            errors.append(np.minimum(np.nan_to_num(off, nan=20.0), 20.0))
        return float(np.concatenate(errors).mean()) if errors else np.nan

    def _about_zero(self, camera: int) -> tuple[str, int, int, tuple[float, ...]]:
        """Arguments of make_lens for a lens with its principal point at (0, 0)."""
        model, parameters = self.lens(camera, (0, 0))
        return model, 1, 1, parameters

    def _seen(self, camera: int) -> tuple[Array, Array]:
        """(pixels (n, 2), points (n, 3) in the camera's frame) of some observations."""
        rows = self.seen[camera]
        pose = self.poses[camera]
        with np.errstate(all="ignore"):
            straight = rows[:, 3:] @ pose.rotation.T + pose.translation
            front = straight[:, 2] > 0
        return rows[front, 1:3], np.ascontiguousarray(straight[front])
