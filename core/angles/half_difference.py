"""Half/difference angles (Rusinkiewicz 1998, "A new change of variables for efficient BRDF
representation"), in both directions, without a tangent frame.

An isotropic BRDF does not depend on the azimuth of the half vector, so three angles remain: θh
(normal to half vector), θd (half vector to light) and φd (azimuth of the light around the half
vector, 0 where the light leans away from the normal). Exchanging light and view (Helmholtz
reciprocity) rotates φd by π, so φd is folded to [0, π).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .vectors import cross, dot, length

Array = NDArray[np.floating]
POLE = 1e-9  # sin θh below it counts as 0


class Angles(NamedTuple):
    """Half/difference angles in radians, arrays of one common shape."""

    theta_h: Array
    theta_d: Array
    phi_d: Array


def fold_phi_d(phi_d: Array) -> Array:
    """φd folded to [0, π) by reciprocity; exact multiples of π (and rounding below 0) give 0."""
    folded = np.mod(phi_d, np.pi)
    return np.where(folded >= np.pi, 0.0, folded)


def half_difference(normal: Array, light: Array, view: Array) -> Angles:
    """Angles of unit vectors (..., 3) that point AWAY from the surface, in any common frame.

    Exact at the poles, also in float32: atan2 of cross and dot products, never acos. Where θh = 0
    the azimuth of the half vector is undefined; φd is then 90°, the value that is symmetric in
    light and view, so that the angles do not depend on the frame. Where θd = 0, φd is 0.

    With H = l + v, the binormal b of n and H, and the tangent t = b × H: l·b = n·(v × l)/|n × H|
    and l·t = |H| (n·v − n·l)/(2 |n × H|). No frame is needed.
    """
    half = light + view
    size = length(half[..., 0], half[..., 1], half[..., 2])
    sin_h = length(*cross(normal, half))
    theta_h = np.arctan2(sin_h, dot(normal, half))
    apart = light - view
    theta_d = np.arctan2(length(apart[..., 0], apart[..., 1], apart[..., 2]), size)
    vx, vy, vz = cross(view, light)
    d_y = normal[..., 0] * vx
    d_y += normal[..., 1] * vy
    d_y += normal[..., 2] * vz
    d_x = dot(normal, view)
    d_x -= dot(normal, light)
    d_x *= 0.5 * size
    phi_d = np.arctan2(d_y, d_x)
    pi = phi_d.dtype.type(np.pi)
    phi_d = np.where(phi_d < 0, phi_d + pi, phi_d)
    phi_d = np.where(phi_d < pi, phi_d, phi_d.dtype.type(0))
    return Angles(theta_h, theta_d, np.where(sin_h > POLE * size, phi_d, pi / 2))


def light_view(theta_h: Array, theta_d: Array, phi_d: Array) -> tuple[Array, Array]:
    """Unit vectors (light, view), each (..., 3), in the frame with the normal = +z and the half
    vector in the x-z plane."""
    theta_h, theta_d, phi_d = np.broadcast_arrays(theta_h, theta_d, phi_d)
    sh, ch, sd, cd = np.sin(theta_h), np.cos(theta_h), np.sin(theta_d), np.cos(theta_d)
    half = np.stack([sh, np.zeros_like(sh), ch], axis=-1)
    # difference vector along the tangent (ch, 0, -sh) and the binormal (0, 1, 0) of the half vector
    d_x, d_y = sd * np.cos(phi_d), sd * np.sin(phi_d)
    light = np.stack([d_x * ch, d_y, -d_x * sh], axis=-1) + cd[..., None] * half
    view = 2.0 * dot(light, half)[..., None] * half - light
    return light, view


def cosines(theta_h: Array, theta_d: Array, phi_d: Array) -> tuple[Array, Array]:
    """(cos θi, cos θo) of light and view; negative below the horizon."""
    base = np.cos(theta_h) * np.cos(theta_d)
    lean = np.sin(theta_h) * np.sin(theta_d) * np.cos(phi_d)
    return base - lean, base + lean
