"""The fitted BRDF as an RGL measured material (`.bsdf`), which Mitsuba 3 and pbrt-v4 read.

Dupuy and Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and
Rendering": for each elevation θi of one direction, f·cosθo is an image over the half vector,
bilinear between its nodes and linear in θi, times `ndf(m) / (4 σ)`. Here

- the warp by visible normals is the identity (`vndf` constant), so the axes of an image are
  u = √(2θm/π) across and v = (φm − φi + π)/2π down;
- σ is ¼, and `ndf` holds the mean profile of the lobe over u at many nodes, so that the images hold
  a smooth ratio, and a sharp highlight is not lost between their nodes;
- `luminance`, from which renderers sample directions, is the luminance of f·cosθo times the measure
  of (u, v): importance sampling of the material itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, half_difference, light_view
from . import spectra

Array = NDArray[np.floating]

SIDE = 80  # nodes a side of an image; the format requires square images
ELEVATIONS = 32
PROFILE = 2048  # nodes of ndf along u
MAX_ELEVATION = np.radians(89.0)  # θi of the last image; it is used beyond this angle too
MIN_DENSITY = 0.02  # of the mean sampling density, added where the material is dark
REC709 = np.array([0.2126, 0.7152, 0.0722])  # luminance weights


@dataclass(frozen=True)
class MeasuredPictures:
    """The images of a measured material. theta_i: (t,) radians; ratio: (3, t, v, u) float32,
    f·cosθo / ndf, channels R, G, B; ndf: (PROFILE,) over u in [0, 1]; density: (t, v, u) sampling
    density, unnormalised."""

    theta_i: NDArray[np.float32]
    ratio: NDArray[np.float32]
    ndf: NDArray[np.float32]
    density: NDArray[np.float32]

    def evaluate(self, angles: Angles) -> Array:
        """f (n, 3) in 1/sr as a renderer computes it, by the interpolation of the format."""
        light, view = light_view(*angles)
        half = light + view
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        azimuth = np.arctan2(half[:, 1], half[:, 0]) - np.arctan2(view[:, 1], view[:, 0])
        u = np.sqrt(np.arccos(np.clip(half[:, 2], -1, 1)) * 2 / np.pi)
        v = np.mod((azimuth + np.pi) / (2 * np.pi), 1.0)
        theta = np.arccos(np.clip(view[:, 2], -1, 1))
        at = np.interp(theta, self.theta_i, np.arange(len(self.theta_i)))
        found = np.zeros((len(u), 3))
        side = self.ratio.shape[-1] - 1
        for t, weight_t in _two(at, len(self.theta_i) - 1):
            for y, weight_v in _two(v * side, side):
                for x, weight_u in _two(u * side, side):
                    weight = weight_t * weight_v * weight_u
                    found += weight[:, None] * self.ratio[:, t, y, x].T
        profile = np.interp(u, np.linspace(0, 1, len(self.ndf)), self.ndf)
        return found * profile[:, None] / np.maximum(light[:, 2], 1e-6)[:, None]

    def fields(self, description: str) -> dict[str, NDArray[Any]]:
        """The arrays of the file by name, with its order of axes; RGB as spectra (spectra.py)."""
        count = len(self.theta_i)
        spread = np.einsum("wc,ctvu->twvu", spectra.BASIS, self.ratio)
        return {
            "description": np.frombuffer(description.encode("ascii", "replace"), np.uint8),
            "jacobian": np.ones(1, np.uint8),
            "phi_i": np.zeros(1, np.float32),
            "theta_i": self.theta_i,
            "wavelengths": spectra.WAVELENGTHS.astype(np.float32),
            "sigma": np.full((2, 2), 0.25, np.float32),
            "ndf": np.tile(self.ndf, (2, 1)),
            "vndf": np.ones((1, count, 2, 2), np.float32),
            "luminance": self.density[None],
            "spectra": spread[None].astype(np.float32),
        }


def pictures(evaluate: Any) -> MeasuredPictures:
    """The images of ``evaluate(angles) -> (n, 3)``, a reciprocal isotropic BRDF in 1/sr."""
    theta_i = np.linspace(0.0, MAX_ELEVATION, ELEVATIONS)
    u, v = np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE)
    theta_m = u**2 * np.pi / 2
    phi = (2 * v - 1) * np.pi
    sin_m = np.sin(theta_m)[None, None, :]
    half = np.stack(
        np.broadcast_arrays(
            sin_m * np.cos(phi)[None, :, None],
            sin_m * np.sin(phi)[None, :, None],
            np.cos(theta_m)[None, None, :],
            np.zeros((ELEVATIONS, 1, 1)),
        )[:3],
        axis=-1,
    )
    first = np.stack([np.sin(theta_i), np.zeros(ELEVATIONS), np.cos(theta_i)], axis=-1)
    first = np.broadcast_to(first[:, None, None], half.shape)
    along = np.einsum("tvuk,tvuk->tvu", first, half)
    second = 2 * along[..., None] * half - first
    cos_o = second[..., 2]
    reached = (cos_o > 0) & (along > 0)
    f = np.zeros((*cos_o.shape, 3))
    normal = np.array([0.0, 0.0, 1.0])
    f[reached] = evaluate(half_difference(normal, second[reached], first[reached]))
    profile = _profile(evaluate)
    ndf_here = np.interp(u, np.linspace(0, 1, PROFILE), profile)
    carried = f * np.maximum(cos_o, 0)[..., None]
    measure = np.maximum(along, 0) * (u * np.sin(theta_m))[None, None, :]
    density = (carried @ REC709) * measure
    density += MIN_DENSITY * density.mean(axis=(1, 2), keepdims=True) + 1e-9
    ratio = np.moveaxis(carried / ndf_here[None, None, :, None], -1, 0)
    return MeasuredPictures(
        theta_i.astype(np.float32),
        np.ascontiguousarray(ratio, np.float32),
        profile.astype(np.float32),
        density.astype(np.float32),
    )


def _profile(evaluate: Any) -> Array:
    """(PROFILE,) luminance of f along u, the mean over some θd (to 45°) and φd: the shape of the
    highlight."""
    u = np.linspace(0, 1, PROFILE)
    theta_d, phi_d = np.radians([5.0, 25.0, 45.0]), np.radians([30.0, 90.0])
    grid = np.meshgrid(u**2 * np.pi / 2, theta_d, phi_d, indexing="ij")
    f = evaluate(Angles(*(a.ravel() for a in grid))) @ REC709
    shape = f.reshape(PROFILE, -1)
    cos = np.cos(u**2 * np.pi / 2)
    kept = np.where(cos > np.cos(np.radians(75.0)), shape.mean(axis=1), 0.0)
    low = max(float(kept.max()) * 1e-6, float(kept[kept > 0].min()) if (kept > 0).any() else 1e-6)
    return np.maximum(kept, low)


def _two(at: Array, last: int) -> list[tuple[NDArray[np.intp], Array]]:
    """(index, weight) of the two nodes 0 … last around each position, for linear interpolation."""
    low = np.clip(np.floor(at).astype(np.intp), 0, max(last - 1, 0))
    high = np.clip(at - low, 0.0, 1.0)
    return [(low, 1.0 - high), (np.minimum(low + 1, last), high)]
