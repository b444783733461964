"""Errors of the camera poses as every reconstruction has them: a third of a pixel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..effects.base.effect import Array
from ..effects.base.parameters import Parameters
from ..effects.camera_pose import CameraPose

USUAL_POSE_ERROR = 0.3  # pixels, RMS, of structure from motion


@dataclass(frozen=True)
class PoseJitter(CameraPose):
    """The same parameters as CameraPose, with the prior of a good reconstruction."""

    cause = "pose_jitter"

    @property
    def parameters(self) -> Parameters:
        found = super().parameters
        return replace(found, deviation=np.full(len(found), USUAL_POSE_ERROR))

    @property
    def combined_slots(self) -> Mapping[int, Mapping[int, Array]]:
        """A rotation shifts each pixel at a right angle to its place in the photo."""
        return {2: {0: -self.y, 1: self.x}}
