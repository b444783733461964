"""The pixels of a diagnosis: some thousands of every photo, lit and shadowed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Pixels:
    """n pixels of all photos.

    photo, material: (n,) int16 numbers in the capture. pixel: (n,) int32 flat index in the photo.
    x, y: (n,) float32 from the photo's centre, 1 at half its diagonal. point: (n, 3) float64;
    normal, view, light: (n, 3) unit; scan frame. irradiance: (n, 3) at normal incidence. visible:
    (n,) fraction of the light that the mesh does not block, 0 in its cast shadow. edge: (n,) pixels
    to the next edge of a shadow, at most REACH. curvature: (n,) 1/pixel, NaN unknown. observed: (n,
    3) radiance; noise: (n, 3) its variance by the photo's own noise. slope: (n, 2, 3) change of the
    observed radiance per pixel to the right and per pixel down; veil: (n, 2, 3) the photo under a
    wide blur, and its mean; background: (n, 3, 3) radiance, veil (2, 3) of the photo's dark
    background, NaN where it shows none. turn, step: (n, 2, 3) change of normal and point per pixel
    to the right and per pixel down. usable: (n,) not clipped. block: (n,) int32 number of the
    held-out region.
    """

    photo: NDArray[np.int16]
    material: NDArray[np.int16]
    pixel: NDArray[np.int32]
    x: NDArray[np.float32]
    y: NDArray[np.float32]
    point: NDArray[np.float64]
    normal: NDArray[np.float32]
    view: NDArray[np.float32]
    light: NDArray[np.float32]
    irradiance: NDArray[np.float32]
    visible: NDArray[np.float32]
    edge: NDArray[np.float32]
    curvature: NDArray[np.float32]
    observed: NDArray[np.float32]
    noise: NDArray[np.float32]
    slope: NDArray[np.float32]
    veil: NDArray[np.float32]
    background: NDArray[np.float32]
    turn: NDArray[np.float32]
    step: NDArray[np.float32]
    usable: NDArray[np.bool_]
    block: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.photo)

    def select(self, which: NDArray | slice) -> Pixels:
        """The rows of a boolean mask, an index array or a slice."""
        return Pixels(**{f.name: getattr(self, f.name)[which] for f in fields(self)})

    @staticmethod
    def join(parts: Sequence[Pixels]) -> Pixels:
        """Concatenation of at least one part."""
        return Pixels(
            **{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Pixels)}
        )
