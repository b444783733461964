"""Directions of light for one view, dense where lobes are: a grid of half vectors.

Half vectors are on a grid of θh (spaced logarithmically, since lobes are narrow) and azimuth φh
from the plane of view and normal, of which one half suffices for an isotropic BRDF. Every direction
of light above the horizon has exactly one half vector.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, half_difference
from ..angles.vectors import dot
from .layered_model import Configuration

Array = NDArray[np.floating]

KNEE = np.radians(0.4)  # θh is spaced linearly below, logarithmically above


def theta_edges(count: int) -> Array:
    """(count + 1,) θh in radians from 0 to 90°, evenly on ln(1 + θh/KNEE)."""
    return KNEE * np.expm1(np.linspace(0, 1, count + 1) * np.log1p(np.pi / 2 / KNEE))


def view_at(theta_o: float) -> Array:
    """(3,) the view at this angle from the normal, +z, in the x-z plane."""
    return np.array([np.sin(theta_o), 0.0, np.cos(theta_o)])


@dataclass(frozen=True)
class Hemisphere:
    """Points of a grid of (θh, φh) for one view; several per cell.

    angles: of each point; cos_i: (n,) of the light, 0 where it is below the horizon or behind the
    half vector; solid: (n,) sr of light that each represents (both halves of φh), 0 likewise;
    half_solid: (n,) sr of half vectors; where: the same points as cosines.
    """

    theta_o: float
    angles: Angles
    cos_i: Array
    solid: Array
    half_solid: Array
    where: Configuration

    @classmethod
    def of(cls, theta_o: float, n_h: int, n_p: int, inside: int = 1) -> Hemisphere:
        """inside: points along each side of a cell. The order is (θh cell, point, φh cell, point),
        C order."""
        edges = theta_edges(n_h * inside)
        # uniform in solid angle inside a cell: 1 − cos θ = 2 sin²(θ/2), exact near the pole
        rise = np.sin(edges / 2) ** 2
        theta = 2 * np.arcsin(np.sqrt(0.5 * (rise[1:] + rise[:-1])))
        phi = (np.arange(n_p * inside) + 0.5) / (n_p * inside) * np.pi
        half_solid = 2 * np.diff(rise) * (2 * np.pi / (n_p * inside))
        t, p = (a.ravel() for a in np.meshgrid(theta, phi, indexing="ij"))
        solid_h = np.repeat(half_solid, n_p * inside)
        half = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
        view = np.broadcast_to(view_at(theta_o), half.shape)
        cos_d = dot(half, view)
        light = 2 * cos_d[:, None] * half - view
        seen = (cos_d > 0) & (light[:, 2] > 0)
        normal = np.broadcast_to(np.array([0.0, 0.0, 1.0]), half.shape)
        safe = np.where(seen[:, None], light, view)
        cos_i = np.where(seen, light[:, 2], 0.0)
        return cls(
            theta_o,
            half_difference(normal, safe, view),
            cos_i,
            np.where(seen, 4 * cos_d * solid_h, 0.0),
            solid_h,
            Configuration(cos_i, view[:, 2], half[:, 2], np.maximum(cos_d, 0.0)),
        )
