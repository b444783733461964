"""The table of samples that every estimator reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles


@dataclass(frozen=True)
class SampleTable:
    """n reflectance samples; row i is one pixel of one photo. Vectors are in the scan frame.

    - photo: (n,) int16 index of the photo; pixel: (n,) int32 flat index in it.
    - theta_h, theta_d, phi_d: (n,) float32, radians, relative to the scanned normal.
    - cos_i, cos_o: (n,) float32. rho: (n, 3) float32, L / (E · cos θi), 1/sr.
    - radiance: (n, 3) float32, in the photo's units; variance: (n, 3) float32 of it by the photo's
      noise, 0 where that was not estimated. irradiance: (n, 3) float32 at normal incidence.
    - light: (n, 3) float32 unit vector surface → light.
    - point: (n, 3) float64, on the surface, scan units; normal, view: (n, 3) float32 unit vectors.
    - curvature: (n,) float32 image-space mean curvature, 1/pixel, NaN where unknown.
    - weight: (n,) float32, how many samples the row represents where not all were kept, else 1.
    - response: (n, 3) float32, derivative of the recorded value by radiance: 1 unless a diagnosis
      corrected the camera's response; 0 where a channel is clipped: its radiance is a lower limit
      (clipped.py), or was predicted by the diagnosis.
    """

    photo: NDArray[np.int16]
    pixel: NDArray[np.int32]
    theta_h: NDArray[np.float32]
    theta_d: NDArray[np.float32]
    phi_d: NDArray[np.float32]
    cos_i: NDArray[np.float32]
    cos_o: NDArray[np.float32]
    rho: NDArray[np.float32]
    radiance: NDArray[np.float32]
    variance: NDArray[np.float32]
    point: NDArray[np.float64]
    normal: NDArray[np.float32]
    view: NDArray[np.float32]
    curvature: NDArray[np.float32]
    light: NDArray[np.float32]
    irradiance: NDArray[np.float32]
    weight: NDArray[np.float32]
    response: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.photo)

    @property
    def angles(self) -> Angles:
        """Half/difference angles, (n,) each, radians."""
        return Angles(self.theta_h, self.theta_d, self.phi_d)

    @property
    def read(self) -> NDArray[np.bool_]:
        """(n,) whether all channels were recorded: none was clipped and predicted."""
        return (self.response > 0).all(axis=1)

    def select(self, which: NDArray) -> SampleTable:
        """The rows of a boolean mask or an index array."""
        return SampleTable(**{f.name: getattr(self, f.name)[which] for f in fields(self)})

    @staticmethod
    def join(tables: Sequence[SampleTable], photos: Sequence[int] | None = None) -> SampleTable:
        """Tables of several photos, one after the other. Photo i of the result is table i, or
        photos[i]."""
        rows = {
            f.name: np.concatenate([getattr(t, f.name) for t in tables])
            for f in fields(SampleTable)
            if f.name != "photo"
        }
        numbers = range(len(tables)) if photos is None else photos
        photo = np.concatenate(
            [np.full(len(t), i, np.int16) for i, t in zip(numbers, tables, strict=True)]
        )
        return SampleTable(photo=photo, **rows)

    @staticmethod
    def concatenate(tables: Sequence[SampleTable]) -> SampleTable:
        """Tables with the same photo indices, one after the other (at least one)."""
        if len(tables) == 1:
            return tables[0]
        return SampleTable(
            **{
                f.name: np.concatenate([getattr(t, f.name) for t in tables])
                for f in fields(SampleTable)
            }
        )

    @staticmethod
    def empty() -> SampleTable:
        """A table without samples."""
        flat, vectors = np.zeros(0, np.float32), np.zeros((0, 3), np.float32)
        return SampleTable(
            photo=np.zeros(0, np.int16), pixel=np.zeros(0, np.int32),
            theta_h=flat, theta_d=flat, phi_d=flat, cos_i=flat, cos_o=flat,
            rho=vectors, radiance=vectors, variance=vectors, point=np.zeros((0, 3)), normal=vectors,
            view=vectors, curvature=flat, light=vectors, irradiance=vectors, weight=flat,
            response=vectors,
        )  # fmt: skip

    @staticmethod
    def prepend(one: SampleTable, rest: SampleTable) -> SampleTable:
        """One table before another with the same photo indices."""
        return SampleTable.concatenate([one, rest])
