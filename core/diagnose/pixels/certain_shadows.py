"""Dark spots that errors of the scan cannot explain.

A stereo mesh is wrong where the surface is thin, folded or seen at grazing angles. There the
object's own shadows are displaced, and light that grazes the surface is predicted badly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import dot, tangents
from ...geometry.view import cast_shadow
from ..forward.diagnosis_context import DiagnosisContext

Array = NDArray[np.floating]

MIN_COS_I = 0.4  # median over a spot: beyond 66° a tilt of 2° changes the light by a tenth
MAX_TURN = np.radians(6.0)  # per pixel, of the normal: beyond, the mesh is too rough
CONE, CONE_RAYS = np.radians(6.0), 12  # about the lamp: nothing of the object may be so near to it
MIN_DARKNESS = 4.5  # standard deviations that a spot's median is too dark
MIN_PIXELS = 10  # of a spot


def certain_shadows(
    context: DiagnosisContext, spot: NDArray[np.intp], residual: Array
) -> NDArray[np.intp]:
    """(n,) number of the spot that each pixel is in, −1 none, without spots that may be errors of
    the scan. spot: (n,) of unexplained_shadows; residual: (n, 3) in standard deviations."""
    pixels, out = context.pixels, np.full(len(spot), -1, np.intp)
    rough = np.linalg.norm(pixels.turn, axis=2).max(axis=1) > MAX_TURN
    rows = np.flatnonzero((spot >= 0) & ~rough)
    rows = rows[~_near_own_shadow(context, rows)]
    cos_i = dot(pixels.normal[rows], pixels.light[rows])
    dark = np.median(residual[rows], axis=1)
    count = 0
    for number in np.unique(spot[rows]):
        mine = spot[rows] == number
        few = np.count_nonzero(mine) < MIN_PIXELS
        if few or np.median(cos_i[mine]) < MIN_COS_I or np.median(dark[mine]) > -MIN_DARKNESS:
            continue
        out[rows[mine]] = count
        count += 1
    return out


def _near_own_shadow(context: DiagnosisContext, rows: NDArray[np.intp]) -> NDArray[np.bool_]:
    """(r,) whether the mesh blocks light from a cone about the lamp."""
    pixels = context.pixels.select(rows)
    first, second = tangents(pixels.light.astype(np.float64))
    blocked = np.zeros(len(rows), bool)
    for turn in np.linspace(0, 2 * np.pi, CONE_RAYS, endpoint=False):
        towards = pixels.light + np.tan(CONE) * (np.cos(turn) * first + np.sin(turn) * second)
        towards /= np.linalg.norm(towards, axis=1, keepdims=True)
        blocked |= cast_shadow(
            context.rays, pixels.point, pixels.normal, towards.astype(np.float32), None
        )
    return blocked
