"""What is known of a flash on a camera before any photo: it is next to the lens, not in
front of it.

Forward offset and beam profile change the falloff across a photo in nearly the same way, so photos
of a small object determine neither alone.
"""

from __future__ import annotations

import numpy as np

from ..light import Light, MountedLight

FORWARD_SPREAD = 0.03  # standard deviation of the forward offset, in units of the reach: 3 cm for
# an object at 1 m
BEAM_SPREAD = 1.0  # of 1/beam², rad⁻²: half of the intensity at 57°
EFFECTIVE_PIXELS = 50.0  # independent residuals of a lamp: about the blocks of its surface


def relative_prior(light: Light, start: Light, reach: float) -> float:
    """Factor − 1 of the cost for what is unlikely of a flash; 0 for other lights.

    start: the light with the stated offset. Minus the logarithm of a normal prior, per effective
    pixel: for absolute residuals with mean b the likelihood is exp(−Σ|r| / b).
    """
    if not (isinstance(light, MountedLight) and isinstance(start, MountedLight)):
        return 0.0
    forward = (light.offset[2] - start.offset[2]) / (FORWARD_SPREAD * reach)
    inverse = 0.0 if light.beam is None else light.beam**-2
    stated = 0.0 if start.beam is None else start.beam**-2
    beam = (inverse - stated) / BEAM_SPREAD
    return float(0.5 * (np.square(forward) + np.square(beam)) / EFFECTIVE_PIXELS)
