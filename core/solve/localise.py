"""The pose of one more photo in an existing scan.

Its SIFT features are matched with those of the scan's own photos, whose positions in space are
known; the matches give the pose. A second round uses the nearest photos of the scan and all matches
consistent with the first pose: different light makes many features similar, but does not move them.
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
MIN_INLIERS = 30  # features that must agree with the final pose
MIN_FIRST_INLIERS = 10  # features that must agree in the first round
DESCRIPTOR_RATIO = 0.85  # of angles to the nearest and second nearest descriptor, see match
RELATIVE_ERROR_LIMIT = 0.002  # maximum error of an inlier as a fraction of the longer side
MIN_ERROR_LIMIT = 2.5  # pixels, lower bound of that maximum
NEAREST_PHOTOS = 10  # photos of the scan used in the second round
MAX_PIXEL_STD, MAX_ANGLE_STD = 2.0, np.radians(0.5)  # larger standard deviations are rejected


class Lift(Protocol):
    """Maps features to points in space: OnMesh or OnSparsePoints."""

    def lift(self, camera: Camera, found: Features) -> Landmarks:
        """The features with known points in space."""

    def visible(self, points: Array, centre: Array) -> NDArray[np.bool_]:
        """(n,) whether points are visible from ``centre``."""


@dataclass(frozen=True)
class Localised:
    """camera: the photo's, with its pose in the scan; inliers: number of features that agree;
    error: their median distance, pixels; angle_deviation (radians), place_deviation (scan units),
    pixel_deviation (pixels): standard deviations of the orientation, of the centre, and of
    projected points of the scan, from the scatter of the features."""

    camera: Camera
    path: Path
    inliers: int
    error: float
    angle_deviation: float
    place_deviation: float
    pixel_deviation: float

    def sentence(self) -> str:
        """A summary in one line."""
        return (
            f"{self.path.name}: {self.inliers} matching features, median error "
            f"{self.error:.2f} pixels; "
            f"standard deviations: {np.degrees(self.angle_deviation):.3f} degrees, "
            f"{self.place_deviation:.3g} scan units, {self.pixel_deviation:.2f} pixels."
        )


class Unsupported(PatinaError):
    """The scan's photos do not determine the pose of the photo."""


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

    found: the photo's features; lenses: cameras of the scan it may have been taken with, resized to
    its size; photos: the scan's; first: indices of those compared first; landmarks: landmarks of
    the scan's photo with that index.
    """
    pixels, points = _matched(found, [landmarks(i) for i in first])
    best: tuple[Camera, FoundPose] | None = None
    for lens in lenses:
        pose = find_pose(lens, pixels, points, _limit(lens))
        if pose is not None and (best is None or pose.inliers.sum() > best[1].inliers.sum()):
            best = (lens, pose)
    first_count = 0 if best is None else _distinct(pixels[best[1].inliers])
    if best is None or first_count < MIN_FIRST_INLIERS:
        raise Unsupported(_too_few(path, first_count, len(found)))
    lens, pose = best
    target = np.median(points[pose.inliers], axis=0)
    for _ in range(2):
        near = nearest(photos, pose.pose.centre, target, NEAREST_PHOTOS)
        landmark_sets = [landmarks(i) for i in near]
        pixels, points = _averaged(*_matched_near(lens, pose, found, landmark_sets, lift))
        refined = refine_pose(lens, pose.pose, pixels, points, _limit(lens))
        if refined is None:
            break
        pose = refined
    count = int(pose.inliers.sum())
    if count < MIN_INLIERS:
        raise Unsupported(_too_few(path, count, len(found)))
    if pose.pixel_deviation > MAX_PIXEL_STD or pose.angle_deviation > MAX_ANGLE_STD:
        raise Unsupported(
            f"{path}: its pose has standard deviations of "
            f"{np.degrees(pose.angle_deviation):.2f} degrees "
            f"and {pose.pixel_deviation:.1f} pixels ({count} features); expected at most 0.5 "
            "degrees "
            "and 2 pixels; show more of the object, across the whole frame"
        )
    camera = replace(lens, label=path.name, pose=pose.pose, photo=path.name)
    return Localised(
        camera, path, count, pose.error,
        pose.angle_deviation, pose.place_deviation, pose.pixel_deviation,
    )  # fmt: skip


def _too_few(path: Path, count: int, features: int) -> str:
    return (
        f"{path}: {count} of its {features} features agree with the scan's photos; expected at "
        f"least {MIN_INLIERS}; check that it shows this object, sharp and well exposed; take "
        "it closer "
        "to a viewpoint of the scan, or add some even light to the lamp"
    )


def _limit(lens: Camera) -> float:
    return max(MIN_ERROR_LIMIT, RELATIVE_ERROR_LIMIT * max(lens.width, lens.height))


def _distinct(pixels: Array) -> int:
    """Number of distinct features; one may match in many photos."""
    return len(np.unique(np.round(pixels, 2), axis=0))


def _matched(found: Features, landmark_sets: Sequence[Landmarks]) -> tuple[Array, Array]:
    """(pixels (n, 2), points (n, 3)) of features with similar descriptors, photo by photo of the
    scan."""
    pixels, points = [np.zeros((0, 2))], [np.zeros((0, 3))]
    for landmark_set in landmark_sets:
        pairs = match(found.descriptors, landmark_set.descriptors, DESCRIPTOR_RATIO)
        pixels.append(found.pixels[pairs[:, 0]])
        points.append(landmark_set.points[pairs[:, 1]])
    return np.concatenate(pixels), np.concatenate(points)


def _matched_near(
    lens: Camera, pose: FoundPose, found: Features, landmark_sets: Sequence[Landmarks], lift: Lift
) -> tuple[Array, Array]:
    """(pixels (n, 2), points (n, 3)) matched with the photos nearest to a pose, without the ratio
    test. Instead a landmark must be visible, and must project close to the feature of the whole
    photo that is most similar to it. By chance one in ten thousand does."""
    camera = replace(lens, pose=pose.pose)
    pixels, points = [np.zeros((0, 2))], [np.zeros((0, 3))]
    for landmark_set in landmark_sets:
        pairs = match(found.descriptors, landmark_set.descriptors, ratio=1.0)
        at, place = found.pixels[pairs[:, 0]], landmark_set.points[pairs[:, 1]]
        with np.errstate(invalid="ignore"):
            near = np.linalg.norm(camera.project(place) - at, axis=1) < _limit(lens)
        at, place = at[near], place[near]
        if len(at):
            seen = lift.visible(place, camera.pose.centre)
            pixels.append(at[seen])
            points.append(place[seen])
    return np.concatenate(pixels), np.concatenate(points)


def _averaged(pixels: Array, points: Array) -> tuple[Array, Array]:
    """One point for each feature, the mean of its points, so that a feature in several photos of
    the scan counts once."""
    if not len(pixels):
        return pixels, points
    unique, group = np.unique(pixels, axis=0, return_inverse=True)
    group = group.ravel()
    count = np.bincount(group, minlength=len(unique))
    mean = np.stack(
        [np.bincount(group, points[:, k], len(unique)) / count for k in range(3)], axis=1
    )
    return unique, mean
