"""A polar slice as in Fig. 9 of the paper: a half-circle with the normal upwards."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.projections.polar import PolarAxes
from numpy.typing import NDArray

from patina.core.views.polar import slice_angles
from patina.core.views.subject import round_up

from .chart_style import BLUE, GREEN, ORANGE, VERMILION

CHANNELS = {"red": VERMILION, "green": GREEN, "blue": BLUE}
"""Channel → colour of its curves."""
TRUTH = {"linestyle": "-", "linewidth": 2.0, "alpha": 0.45}
FIT = {"linestyle": (0, (3.5, 1.5)), "linewidth": 1.0}
LIGHT = {"linestyle": ":", "linewidth": 1.2, "color": ORANGE}
RINGS = (1.0, 0.2, 0.02)
"""Values of ρ that have a ring, relative to the outer ring."""


def half_circle(
    axes: PolarAxes,
    curves: Sequence[tuple[NDArray[np.float64], dict]],
    incidence: float,
    top: float,
) -> None:
    """Draw curves ((n, 3) ρ at the directions of slice_angles, line style) into polar axes.

    The radius is the cube root of ρ in units of the outer ring. The outer ring is ``top``, rounded
    up to 1, 2 or 5 times a power of ten, so that panels of one material can share it. Light comes
    from the left at ``incidence`` degrees.
    """
    theta, _ = slice_angles(np.radians(incidence))
    ring = round_up(top)
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_thetamin(-90)
    axes.set_thetamax(90)
    axes.set_rlim(0, 1)
    axes.set_thetagrids([-45, 0, 45], ["−45°", "0°", "45°"])
    axes.set_rgrids([float(np.cbrt(r)) for r in RINGS], [f"{ring * r:.3g}" for r in RINGS])
    axes.tick_params(axis="x", pad=-2)  # matplotlib adds 7 points to this
    axes.tick_params(axis="y", pad=1)
    axes.grid(True, axis="both", clip_on=False)  # nothing is outside the outer ring
    axes.patch.set_visible(False)
    axes.plot([-np.radians(incidence)] * 2, [0.0, 1.0], clip_on=False, **LIGHT)
    for values, style in curves:
        radius = np.cbrt(np.maximum(values, 0) / ring)
        for channel, colour in enumerate(CHANNELS.values()):
            axes.plot(theta, radius[:, channel], color=colour, clip_on=False, **style)
