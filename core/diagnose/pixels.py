"""The pixels that a diagnosis looks at: some thousands of every photo, lit ones and shadowed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Pixels:
    """n pixels of all photos.

    photo, material: (n,) int16 numbers in the capture. pixel: (n,) int32 flat index in the photo.
    x, y: (n,) float32 from the photo's centre, 1 at half its diagonal. point: (n, 3) float64;
    normal, view, light: (n, 3) unit; scan frame. irradiance: (n, 3) at normal incidence. distance:
    (n,) to the light, inf for a distant one. visible: (n,) 1 where the mesh lets the light through,
    0 in its cast shadow. edge: (n,) pixels to the next edge of a shadow, at most REACH. curvature:
    (n,) 1/pixel, NaN unknown. observed: (n, 3) radiance; noise: (n, 3) its variance by the photo's
    own noise. shift: (n, 2, 3) what a pixel to the right and a pixel down show more, as a fraction
    of the photo's typical radiance (NaN unknown). usable: (n,) not clipped. block: (n,) int32 the
    part of its photo each is in.
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
    distance: NDArray[np.float32]
    visible: NDArray[np.float32]
    edge: NDArray[np.float32]
    curvature: NDArray[np.float32]
    observed: NDArray[np.float32]
    noise: NDArray[np.float32]
    slope: NDArray[np.float32]
    veil: NDArray[np.float32]
    usable: NDArray[np.bool_]
    block: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.photo)

    def select(self, which: NDArray | slice) -> Pixels:
        """The rows of a boolean mask, an index array or a slice."""
        return Pixels(**{f.name: getattr(self, f.name)[which] for f in fields(self)})

    @staticmethod
    def none() -> Pixels:
        """No pixels at all."""
        columns = {"point": (0, 3), "slope": (0, 2, 3)}
        vectors = ("normal", "view", "light", "irradiance", "observed", "noise", "veil")
        kinds: dict[str, Any] = {
            "photo": np.int16,
            "material": np.int16,
            "pixel": np.int32,
            "block": np.int32,
        }
        kinds |= {"point": np.float64, "usable": np.bool_}
        return Pixels(
            **{
                f.name: np.zeros(
                    columns.get(f.name, (0, 3) if f.name in vectors else (0,)),
                    kinds.get(f.name, np.float32),
                )
                for f in fields(Pixels)
            }
        )

    @staticmethod
    def join(parts: Sequence[Pixels]) -> Pixels:
        """One after the other (at least one)."""
        return Pixels(
            **{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Pixels)}
        )
