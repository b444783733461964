"""Errors of the logarithm of the radiance of nodes, which no parameter explains."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .node_model import COUNT, TILT, NodeModel
from .observations import Observations

Array = NDArray[np.floating]

MIN_ERROR, MAX_ERROR = 0.01, 0.5  # of the logarithm of the radiance, that no parameter explains
MAX_HUE_RATIO = 2.0
"""Of the errors of brightness and of hue. They differ by more on real captures, but errors of the
highlights' colour are a part of those of the hue: of four captures, a ratio of 3 predicted held-out
photos of one worse than 1, and 2 of none."""
BLACK_SHARE = 0.03  # of the median radiance, added before the logarithm
BISECTIONS = 12  # of the error of the logarithm: to 0.1 %
MAX_OBSERVATIONS = 1 << 17  # that the errors are estimated from


@dataclass(frozen=True)
class RadianceError:
    """Errors of the logarithm of the radiance. error: standard deviation that is the same for all
    observations; normal_error: of the normals, radians. hue: ratio of the errors of brightness and
    of hue, 1 or more: errors of shadows, normals and exposure are alike in all channels. Only the
    second estimate of the colour uses it: in highlights, the hue depends on the normals too."""

    error: float
    normal_error: float
    hue: float = 1.0

    def without_hue(self) -> RadianceError:
        """The same with equal errors of brightness and hue."""
        return replace(self, hue=1.0)

    def variance(self, steep: Array) -> Array:
        """(m,) variances of scaled observations whose steepness is (m,)."""
        return self.error**2 + self.normal_error**2 * steep

    def scaled(self, residual: Array, slope: Array) -> tuple[Array, Array]:
        """Residuals (m, 3) and derivatives (m, 3, k) in which the differences of the channels are
        multiplied by ``hue``."""
        mixed = (self.hue * np.eye(3) + (1 - self.hue) / 3).astype(np.float32)
        return residual @ mixed, np.matmul(mixed, slope)

    @classmethod
    def of(
        cls,
        model: NodeModel,
        seen: Observations,
        normal: NDArray[np.float32],
        theta: NDArray[np.float32],
        black: float,
        normal_error: float,
    ) -> RadianceError:
        """The errors that a part of the observations shows: those for which the median of the
        absolute normalised residuals is that of a normal distribution."""
        some = seen.select(
            np.arange(0, len(seen), max(1, len(seen) // MAX_OBSERVATIONS))
        ).measured()
        if not len(some):
            return cls(MAX_ERROR, normal_error)
        free = np.zeros(COUNT, bool)
        free[TILT] = True
        residual, slope = log_residuals(model, some, normal, theta, black, free)
        mean = residual.mean(axis=1, keepdims=True)
        brightness = robust_deviation(np.sqrt(3) * mean)  # of one channel, if all are independent
        differences = robust_deviation(np.sqrt(1.5) * (residual - mean))  # the same
        hue = float(np.clip(brightness / max(differences, 1e-6), 1.0, MAX_HUE_RATIO))
        steep = steepness(slope)
        low, high = MIN_ERROR, MAX_ERROR
        for _ in range(BISECTIONS):
            middle = cls(float(np.sqrt(low * high)), normal_error, hue)
            normalised = residual / np.sqrt(middle.variance(steep))[:, None]
            if robust_deviation(normalised) > 1:
                low = middle.error
            else:
                high = middle.error
        return middle


def log_residuals(
    model: NodeModel,
    seen: Observations,
    normal: NDArray[np.float32],
    theta: NDArray[np.float32],
    black: float,
    free: NDArray[np.bool_],
) -> tuple[Array, NDArray[np.float32]]:
    """(measured minus predicted logarithm of the radiance (m, 3), derivatives (m, 3, 10) of the
    prediction by the parameters), both 0 where a channel is clipped and predicted to be. free:
    (10,) parameters whose derivatives are computed."""
    node = seen.node
    predicted, slope = model.derivatives(seen.shading, normal[node], theta[node], free)
    predicted += np.float32(black)
    residual = np.log(np.maximum(seen.radiance, 0) + black) - np.log(predicted)
    slope /= predicted[:, :, None]
    explained = seen.clipped & (residual < 0)
    residual[explained], slope[explained] = 0, 0
    return residual, slope


def steepness(slope: NDArray[np.float32]) -> Array:
    """(m,) squared change of the logarithm for a tilt of the normal of one radian, the mean of the
    channels. slope: (m, 3, 10) derivatives by the parameters."""
    found: Array = np.square(slope[:, :, TILT]).sum(axis=2).mean(axis=1)
    return found


def near_black(seen: Observations) -> float:
    """The radiance that is added before the logarithm."""
    return BLACK_SHARE * float(np.median(seen.radiance.mean(axis=1))) if len(seen) else 1.0


def robust_deviation(residual: Array) -> float:
    """Standard deviation by the median of the absolute values: outliers do not matter."""
    return float(np.median(np.abs(residual)) / 0.6745)
