"""SIFT features of one picture (pycolmap), and matching with those of another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pycolmap
from numpy.typing import NDArray

from .picture import Grey

MAX_SIDE = 3200  # pixels; larger pictures are reduced to this size
BLOCK = 2048  # descriptors compared together


@dataclass(frozen=True)
class Features:
    """pixels: (n, 2), the centre of the top left pixel at (0.5, 0.5); descriptors: (n, 128) uint8,
    square roots of L1-normalised SIFT (Arandjelović & Zisserman 2012). keypoints: (n, 4 or 6) in
    COLMAP's layout. Sorted by decreasing scale."""

    keypoints: NDArray[np.float32]
    descriptors: NDArray[np.uint8]

    @property
    def pixels(self) -> NDArray[np.float64]:
        return self.keypoints[:, :2].astype(np.float64)

    def __len__(self) -> int:
        return len(self.keypoints)


class Detector:
    """A SIFT detector with its settings; use one per thread."""

    def __init__(self, max_features: int = 8192, pooled: bool = False) -> None:
        """max_features: the number of features kept, largest first. pooled: descriptors averaged
        over domain sizes on affine-adapted regions (Dong & Soatto 2015): takes 1.5 times as long
        and is more robust."""
        pycolmap.logging.minloglevel = 3  # otherwise it writes to stderr
        options = pycolmap.FeatureExtractionOptions()
        options.use_gpu = False
        options.num_threads = 1
        options.sift.max_num_features = max_features
        options.sift.domain_size_pooling = pooled
        options.sift.estimate_affine_shape = pooled
        self._extractor = pycolmap.FeatureExtractor.create(options, pycolmap.Device.cpu)

        self._max_features = max_features

    def __call__(self, grey: Grey) -> Features:
        """Features of a picture (h, w)."""
        bitmap = pycolmap.Bitmap.from_array(np.ascontiguousarray(grey))
        height, width = grey.shape
        factor = min(1.0, MAX_SIDE / max(height, width))
        if factor < 1.0:
            bitmap.rescale(max(1, round(width * factor)), max(1, round(height * factor)))
        across, down = width / bitmap.width, height / bitmap.height
        found, descriptors = self._extractor.extract(bitmap)
        keypoints = np.asarray(pycolmap.keypoints_to_matrix(found), np.float32).copy()
        if not len(keypoints):
            return Features(np.zeros((0, 4), np.float32), np.zeros((0, 128), np.uint8))
        keypoints[:, 0] *= across
        keypoints[:, 1] *= down
        _stretch(keypoints, across, down)
        data = np.asarray(descriptors.data, np.uint8).reshape(-1, 128)
        order = np.argsort(-_scale(keypoints), kind="stable")[: self._max_features]
        return Features(keypoints[order], data[order])


def _stretch(keypoints: NDArray[np.float32], across: float, down: float) -> None:
    """Scale sizes found in a smaller copy to the photo's own size."""
    if keypoints.shape[1] == 6:
        keypoints[:, 2:4] *= across
        keypoints[:, 4:6] *= down
    else:
        keypoints[:, 2] *= 0.5 * (across + down)


def _scale(keypoints: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n,) size of each region, pixels. Columns: x, y, then the region's affine matrix."""
    if keypoints.shape[1] == 6:
        a11, a12, a21, a22 = keypoints[:, 2:].T
        return np.sqrt(np.abs(a11 * a22 - a12 * a21))
    return keypoints[:, 2]


def match(
    one: NDArray[np.uint8], other: NDArray[np.uint8], ratio: float = 0.85
) -> NDArray[np.intp]:
    """(m, 2) indices of mutually nearest descriptors whose angle is below ``ratio`` times the angle
    to the second nearest (Lowe 2004)."""
    if len(one) < 2 or len(other) < 2:
        return np.zeros((0, 2), np.intp)
    b = _unit(other)
    nearest = np.empty(len(one), np.intp)
    first, second = np.empty(len(one), np.float32), np.empty(len(one), np.float32)
    back_value = np.full(len(other), -1.0, np.float32)
    back = np.zeros(len(other), np.intp)
    for begin in range(0, len(one), BLOCK):
        part = slice(begin, begin + BLOCK)
        cosine = _unit(one[part]) @ b.T
        rows = np.arange(len(cosine))
        top = cosine.max(axis=0)
        better = top > back_value
        back[better] = begin + cosine.argmax(axis=0)[better]
        back_value[better] = top[better]
        nearest[part] = cosine.argmax(axis=1)
        first[part] = cosine[rows, nearest[part]]
        cosine[rows, nearest[part]] = -1.0
        second[part] = cosine.max(axis=1)
    near, next_near = (np.arccos(np.clip(c, -1.0, 1.0)) for c in (first, second))
    good = (back[nearest] == np.arange(len(one))) & (near < ratio * next_near)
    return np.stack([np.flatnonzero(good), nearest[good]], axis=1)


def _unit(descriptors: NDArray[np.uint8]) -> NDArray[np.float32]:
    values = descriptors.astype(np.float32)
    return values / np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-6)
