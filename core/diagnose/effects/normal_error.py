"""The mesh is smoother or rougher than the surface: its normals are off, patch by patch."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...angles.vectors import tangents
from ..effect import Array, Near, Numbers, Setting
from ..patch_effect import PatchEffect
from ..patches import surface_patches
from ..situation import Situation

USUAL = np.radians(2.0)
FARTHEST = np.radians(25.0)


@dataclass(frozen=True)
class NormalError(PatchEffect):
    """numbers: for each patch of the surface the tangents of two angles that its normal is tilted
    by, along ``first`` and ``other``, (n, 3) unit."""

    first: Array
    other: Array
    cause = "normal_error"
    proof = "a closer scan of a part of the surface"

    @classmethod
    def of(cls, setting: Setting) -> NormalError | None:
        patch = surface_patches(setting)
        known = np.flatnonzero(patch >= 0)
        if not len(known):
            return None
        normal = setting.pixels.normal.astype(np.float64)
        sums = [np.bincount(patch[known], normal[known, k]) for k in range(3)]
        mean = np.stack(sums, axis=1).astype(np.float64)
        mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-9)
        at = [v[patch].astype(np.float32) for v in tangents(mean)]
        return cls(patch, (USUAL,) * 2, *at)

    def elsewhere(self, setting: Setting, near: Near) -> NormalError:
        at = near.surface
        return replace(self, parts=self.parts[at], first=self.first[at], other=self.other[at])

    @property
    def numbers(self) -> Numbers:
        names = [f"patch {k + 1}, {way}" for k in range(self.count) for way in ("first", "second")]
        alike = Numbers.alike(names, "rad", 1.0, -FARTHEST, FARTHEST)
        return replace(alike, deviation=self.deviation)

    def before(self, now: Situation, x: np.ndarray) -> Situation:
        tilt = self.felt(x)
        normal = now.normal + tilt[:, :1] * self.first + tilt[:, 1:] * self.other
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return replace(now, normal=normal)

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        angle = np.degrees(np.hypot(x[0::2], x[1::2]))
        return (
            "the mesh does not follow the surface: its normals are off by "
            f"{np.median(angle):.1f}° in the median and {np.percentile(angle, 95):.1f}° in the "
            "worst twentieth (too smooth a mesh, or a noisy one)"
        )
