"""The BRDF that a chart shows, and the scale and channels that it is shown with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..samples import MeasuredPoints
from .drawing import rgb

Evaluate = Callable[[Angles], NDArray[np.floating]]
Channels = Literal["rgb", "r", "g", "b", "mean"]
Scale = Literal["cube_root", "linear", "log"]

COLOURS = ("#d62728", "#2a9d3a", "#1f5fd6")
MEAN = "#333944"
DECADES = 3.0  # factors of ten that a logarithmic scale spans
OTHER_DASH = (5.0, 3.0)
RINGS = {"cube_root": (1.0, 0.3, 0.1, 0.03, 0.01), "linear": (1.0, 0.75, 0.5, 0.25),
         "log": (1.0, 0.1, 0.01)}  # fmt: skip


@dataclass(frozen=True)
class Subject:
    """A fitted BRDF. evaluate(angles) → ρ (n, 3) in 1/sr. interval(angles) → (low, high), (n, 3)
    each, the 90 % interval. points: the samples."""

    label: str
    evaluate: Evaluate
    interval: Callable[[Angles], tuple[NDArray[np.floating], NDArray[np.floating]]] | None = None
    points: MeasuredPoints | None = None


@dataclass(frozen=True)
class Show:
    """How reflectance is shown. scale: of the axis. cosine: show ρ·cos θi instead of ρ. channels:
    R, G and B, one of them, or their mean."""

    scale: Scale = "cube_root"
    cosine: bool = False
    channels: Channels = "rgb"

    @property
    def colours(self) -> tuple[str, ...]:
        """The colour of each curve."""
        if self.channels == "mean":
            return (MEAN,)
        return COLOURS if self.channels == "rgb" else (COLOURS["rgb".index(self.channels)],)

    @property
    def unit(self) -> str:
        """The quantity and its unit, for labels."""
        return "ρ cos θi, 1/sr" if self.cosine else "ρ, 1/sr"

    @property
    def scale_name(self) -> str:
        """The name of the scale, for labels."""
        return {"cube_root": "cube root", "linear": "linear", "log": "logarithmic"}[self.scale]

    def select_channels(self, rho: NDArray[np.floating]) -> NDArray[np.float64]:
        """(n, 3) → (n, c), the channels that are shown."""
        if self.channels == "mean":
            return np.asarray(rho, np.float64).mean(axis=1, keepdims=True)
        if self.channels == "rgb":
            return np.asarray(rho, np.float64)
        place = "rgb".index(self.channels)
        return np.asarray(rho, np.float64)[:, place : place + 1]

    def values(
        self, rho: NDArray[np.floating], cos_i: NDArray[np.floating] | float
    ) -> NDArray[np.float64]:
        """ρ (n, 3) → (n, c) the values that are shown, not below 0; cos_i: (n,) or a number."""
        found = np.maximum(self.select_channels(rho), 0.0)
        return found * np.broadcast_to(cos_i, len(found))[:, None] if self.cosine else found

    def length(self, value: NDArray[np.floating] | float, top: float) -> NDArray[np.float64]:
        """Position of a value on the scale: 0 at its start, 1 at the value ``top``; larger values
        give more than 1."""
        part = np.clip(np.asarray(value, np.float64) / top, 0.0, None)
        if self.scale == "linear":
            return part
        if self.scale == "log":
            return np.maximum(1 + np.log10(np.maximum(part, 1e-12)) / DECADES, 0.0)
        return np.cbrt(part)

    def rings(self) -> tuple[float, ...]:
        """The grid lines of the scale, as fractions of its top value."""
        return RINGS[self.scale]


def round_up(x: float) -> float:
    """The smallest 1, 2 or 5 × 10ⁿ that is not below x."""
    power = 10.0 ** np.floor(np.log10(max(x, 1e-9)))
    return float(next(m * power for m in (1, 2, 5, 10) if m * power >= x * (1 - 1e-9)))


def dark(colour: str) -> NDArray[np.uint8]:
    """(3,) a darker shade of a colour, for samples drawn over a curve of that colour."""
    return (rgb(colour).astype(int) * 2 // 3).astype(np.uint8)
