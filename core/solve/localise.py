"""The pose of one more photo in a scan that is there already.

Its SIFT features are matched with those of the scan's own photos, which are known in space; from
the pairs follows the pose. Then once more, with the photos nearest to it, and with all pairs that
the first pose bears out: light that differs makes many places look alike, but does not move them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import PatinaError
from ..scan import Camera
from .features import Features, match
from .landmarks import Landmarks
from .pose import FoundPose, find_pose, refine_pose
from .scan_photos import ScanPhoto, nearest

Array = NDArray[np.float64]
FEWEST = 30  # features that must agree
FEWEST_FIRST = 10  # of them in the first round
RATIO = 0.85
LIMIT = 0.002  # of the longer side: how far off an agreeing feature may be
SMALLEST_LIMIT = 2.5  # pixels
CLOSEST = 10  # photos of the scan looked at in the second round
UNSURE_PIXELS, UNSURE_ANGLE = 2.0, np.radians(0.5)  # standard deviations beyond which to refuse


class Lift(Protocol):
    """Where features are in space: OnMesh or OnSparsePoints."""

    def lift(self, camera: Camera, found: Features) -> Landmarks:
        """The features that are known in space."""

    def visible(self, points: Array, centre: Array) -> NDArray[np.bool_]:
        """(n,) whether points can be seen from ``centre``."""


@dataclass(frozen=True)
class Localised:
    """camera: the photo's, with its pose in the scan; inliers: features that agree; error: their
    median distance, pixels; angle_deviation (radians), place_deviation (scan units),
    pixel_deviation: standard deviations of the orientation, of the centre, and of where points of
    the scan appear in the photo, from the features' own scatter."""

    camera: Camera
    path: Path
    inliers: int
    error: float
    angle_deviation: float
    place_deviation: float
    pixel_deviation: float

    def sentence(self) -> str:
        """One line."""
        return (
            f"{self.path.name}: {self.inliers} features agree to {self.error:.2f} pixels "
            f"(median); known to {np.degrees(self.angle_deviation):.3f} degrees, "
            f"{self.place_deviation:.3g} scan units, {self.pixel_deviation:.2f} pixels"
        )


class Unsupported(PatinaError):
    """A photo that the scan's photos do not say enough about."""


def localise(
    path: Path,
    found: Features,
    lenses: Sequence[Camera],
    photos: Sequence[ScanPhoto],
    first: Sequence[int],
    landmarks: Callable[[int], Landmarks],
    lift: Lift,
) -> Localised:
    """The camera of a photo. Raises Unsupported.

    found: its features; lenses: cameras of the scan it may have been taken with, of its size;
    photos: the scan's; first: those looked at first; landmarks: what the scan's photo of a number
    shows.
    """
    pixels, points = _matched(found, [landmarks(i) for i in first])
    best: tuple[Camera, FoundPose] | None = None
    for lens in lenses:
        pose = find_pose(lens, pixels, points, _limit(lens))
        if pose is not None and (best is None or pose.inliers.sum() > best[1].inliers.sum()):
            best = (lens, pose)
    first_count = 0 if best is None else _distinct(pixels[best[1].inliers])
    if best is None or first_count < FEWEST_FIRST:
        raise Unsupported(_too_few(path, first_count, len(found)))
    lens, pose = best
    target = np.median(points[pose.inliers], axis=0)
    for _ in range(2):
        near = nearest(photos, pose.pose.centre, target, CLOSEST)
        shown = [landmarks(i) for i in near]
        pixels, points = _averaged(*_looked_for(lens, pose, found, shown, lift))
        refined = refine_pose(lens, pose.pose, pixels, points, _limit(lens))
        if refined is None:
            break
        pose = refined
    count = int(pose.inliers.sum())
    if count < FEWEST:
        raise Unsupported(_too_few(path, count, len(found)))
    if pose.pixel_deviation > UNSURE_PIXELS or pose.angle_deviation > UNSURE_ANGLE:
        raise Unsupported(
            f"{path}: its pose is known to {np.degrees(pose.angle_deviation):.2f} degrees and "
            f"{pose.pixel_deviation:.1f} pixels only ({count} features): show more of the object "
            "in the photo, all over the frame"
        )
    camera = replace(lens, label=path.name, pose=pose.pose, photo=path.name)
    return Localised(
        camera, path, count, pose.error,
        pose.angle_deviation, pose.place_deviation, pose.pixel_deviation,
    )  # fmt: skip


def _too_few(path: Path, count: int, features: int) -> str:
    return (
        f"{path}: {count} of its {features} features agree with the scan's photos, expected at "
        f"least {FEWEST}; is it of this object, sharp and well exposed? Take it from nearer to a "
        "viewpoint of the scan, or with some even light as well as the lamp"
    )


def _limit(lens: Camera) -> float:
    return max(SMALLEST_LIMIT, LIMIT * max(lens.width, lens.height))


def _distinct(pixels: Array) -> int:
    """How many features: one may have been matched in many photos."""
    return len(np.unique(np.round(pixels, 2), axis=0))


def _matched(found: Features, shown: Sequence[Landmarks]) -> tuple[Array, Array]:
    """(pixels (n, 2), points (n, 3)) of features that look alike, photo by photo of the scan."""
    pixels, points = [np.zeros((0, 2))], [np.zeros((0, 3))]
    for there in shown:
        pairs = match(found.descriptors, there.descriptors, RATIO)
        pixels.append(found.pixels[pairs[:, 0]])
        points.append(there.points[pairs[:, 1]])
    return np.concatenate(pixels), np.concatenate(points)


def _looked_for(
    lens: Camera, pose: FoundPose, found: Features, shown: Sequence[Landmarks], lift: Lift
) -> tuple[Array, Array]:
    """The same with the photos nearest to a pose, and no feature that only another place looks
    like: instead a landmark must be visible, and appear where the feature is that is most like it
    in all of the photo. By chance one in ten thousand does."""
    camera = replace(lens, pose=pose.pose)
    pixels, points = [np.zeros((0, 2))], [np.zeros((0, 3))]
    for there in shown:
        pairs = match(found.descriptors, there.descriptors, ratio=1.0)
        at, place = found.pixels[pairs[:, 0]], there.points[pairs[:, 1]]
        with np.errstate(invalid="ignore"):
            near = np.linalg.norm(camera.project(place) - at, axis=1) < _limit(lens)
        at, place = at[near], place[near]
        if len(at):
            seen = lift.visible(place, camera.pose.centre)
            pixels.append(at[seen])
            points.append(place[seen])
    return np.concatenate(pixels), np.concatenate(points)


def _averaged(pixels: Array, points: Array) -> tuple[Array, Array]:
    """One point a feature: the mean of its own, so that a feature that several photos of the scan
    show counts once."""
    if not len(pixels):
        return pixels, points
    unique, group = np.unique(pixels, axis=0, return_inverse=True)
    group = group.ravel()
    count = np.bincount(group, minlength=len(unique))
    mean = np.stack(
        [np.bincount(group, points[:, k], len(unique)) / count for k in range(3)], axis=1
    )
    return unique, mean
