"""Visibility of the light at each surface point: shadows with soft edges, from the size of the
light and the uncertainty of the mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..angles.vectors import tangents
from ..geometry import RayScene, SurfaceView
from ..light import DistantLight, Light
from ..scan import Camera, Mesh

Array = NDArray[np.float64]

SAMPLES = 64  # rays of a pixel in a soft edge: visibility in steps of 1.6 %
RAYS_AT_ONCE = 1 << 18  # to limit memory
# Uncertainty of the mesh in median edge lengths. Two dense stereo meshes with known ground truth
# have errors of 0.08 and 0.04 (median), and of 0.23 and 0.14 at the 95th percentile
UNCERTAINTY = 0.25
MIN_COSINE = 0.2  # limits the shift of a ray's start along the surface at grazing light
GOLDEN_ANGLE = np.pi * (3.0 - 5.0**0.5)
TOLERANCE = 0.05  # missing fraction of the light above which a pixel counts as shadow


def mesh_uncertainty(mesh: Mesh) -> float:
    """Assumed error of the outlines of the mesh in scan units: a quarter of its median edge."""
    edges = mesh.vertices[mesh.faces] - mesh.vertices[np.roll(mesh.faces, 1, axis=1)]
    return UNCERTAINTY * float(np.median(np.linalg.norm(edges, axis=2)))


def light_visibility(
    rays: RayScene,
    view: SurfaceView,
    light: Light,
    camera: Camera,
    samples: int = SAMPLES,
    uncertainty: float | None = None,
) -> NDArray[np.float32]:
    """(n,) the visible fraction, 0…1, of the disc of the light at each point of ``view``.

    A distant light is a disc of its angular radius, a near or mounted one a sphere of its radius;
    the part below the horizon of the smooth normal is not visible. uncertainty: scan units (None:
    mesh_uncertainty). Rays start on a disc of this radius around the point, perpendicular to the
    light and projected along it onto the tangent plane. This is equivalent to shifting the
    occluder, so a hard edge becomes a ramp of ± uncertainty, whatever the distance of the occluder.

    Samples on the discs form a spiral, rotated by a hash of the pixel to avoid visible patterns. If
    twelve rays on the rims and inside the discs agree, no other rays are cast. If light and
    uncertainty have no size, a single ray gives the same result as cast_shadow.
    """
    incidence = light.incidence(view.point, camera)
    blur = mesh_uncertainty(rays.mesh) if uncertainty is None else uncertainty
    radius = _angular_radius(light, incidence.distance, len(view.point))
    cos_i = np.einsum("ij,ij->i", view.normal, incidence.towards)
    visible = np.zeros(len(view.point), np.float32)
    above = np.flatnonzero(cos_i > -np.sin(radius))
    if samples < 2 or (blur <= 0 and not radius.any()):
        samples = 1
    step = max(1, RAYS_AT_ONCE // max(samples, 1))
    for begin in range(0, len(above), step):
        rows = above[begin : begin + step]
        part = _Points(
            rays,
            view.point[rows],
            view.normal[rows],
            incidence.towards[rows],
            None if incidence.distance is None else incidence.distance[rows],
            radius[rows],
            blur if samples > 1 else 0.0,
            _hashed_turn(view.pixel[rows]),
        )
        visible[rows] = part.seen(samples)
    return visible


def _angular_radius(light: Light, distance: Array | None, count: int) -> Array:
    """(n,) angular radius of the light in radians at each point; distance: (n,), None for a distant
    light."""
    if distance is None:
        return np.full(count, light.angular_radius if isinstance(light, DistantLight) else 0.0)
    size = float(getattr(light, "radius", 0.0))
    return np.arcsin(np.clip(size / np.maximum(distance, 1e-12), 0.0, 1.0))


def _spiral(samples: int) -> Array:
    """(samples, 4): area fraction and angle on the disc of the light, then on the disc of starts.

    Vogel's spiral fills the first disc. Fractions and angles on the second one advance by other
    irrational numbers (Roberts 2018, the plastic number), so that the two are uncorrelated.
    """
    number = np.arange(samples)
    return np.stack(
        [
            (number + 0.5) / samples,
            number * GOLDEN_ANGLE,
            (0.5 + number * 0.7548776662466927) % 1.0,
            2 * np.pi * ((0.5 + number * 0.5698402909980532) % 1.0),
        ],
        axis=1,
    )


def _scouts(rim: int = 8, inner: int = 4) -> Array:
    """(rim + inner, 4) first rays, on the rims of both discs and inside, in the format of _spiral.
    A straight edge that eight rays on the rim miss cuts off at most 1.2 % of the disc."""
    angle = 2 * np.pi * np.concatenate([np.arange(rim) / rim, (np.arange(inner) + 0.5) / inner])
    share = np.where(np.arange(rim + inner) < rim, 1.0, 0.2)
    return np.stack([share, angle, share, angle], axis=1)


SCOUTS = _scouts()


def _hashed_turn(pixel: NDArray[np.int32]) -> Array:
    """(n,) a pseudorandom rotation in radians for each pixel (Knuth's multiplicative hash)."""
    mixed = (pixel.astype(np.uint64) * np.uint64(2654435761)) & np.uint64(0xFFFFFFFF)
    mixed ^= mixed >> np.uint64(15)
    mixed = (mixed * np.uint64(2246822519)) & np.uint64(0xFFFFFFFF)
    return mixed.astype(np.float64) * (2 * np.pi / 2**32)


class _Points:
    """Surface points with the directions and sizes of their light, for visibility tests."""

    def __init__(
        self,
        rays: RayScene,
        point: Array,
        normal: Array,
        towards: Array,
        distance: Array | None,
        radius: Array,
        blur: float,
        turn: Array,
    ) -> None:
        self.rays, self.blur = rays, blur
        self.point, self.normal, self.towards = point, normal, towards
        self.distance, self.radius, self.turn = distance, radius, turn
        self.start = point + rays.lift * normal
        # two axes perpendicular to the direction of the light
        self.across, self.along = tangents(towards)

    def seen(self, samples: int) -> NDArray[np.float32]:
        """(n,) visible fraction of the light; up to ``samples`` rays for each point."""
        every = np.arange(len(self.point))
        if samples == 1:
            return self._open(every, None)[:, 0].astype(np.float32)
        free = self._open(every, SCOUTS).mean(axis=1)
        mixed = np.flatnonzero((free > 0) & (free < 1))
        if len(mixed):
            free[mixed] = self._open(mixed, _spiral(samples)).mean(axis=1)
        return free.astype(np.float32)

    def _open(self, which: NDArray, pattern: Array | None) -> NDArray[np.bool_]:
        """(points, rays) True where a ray of the points ``which`` reaches the light.

        pattern: (rays, 4) as of _spiral; None: a single ray to the centre of the light."""
        count = 1 if pattern is None else len(pattern)
        rows = np.repeat(which, count)
        towards, start = self.towards[rows], self.start[rows]
        limits = None if self.distance is None else self.distance[rows]
        if pattern is not None:
            share, angle, far, aside = np.tile(pattern, (len(which), 1)).T
            turn = self.turn[rows]
            towards, cosine = self._to_disc(rows, share, angle + turn)
            if limits is not None:
                limits = limits * cosine
            if self.blur > 0:
                start = start + self._shift(rows, far, aside + turn)
        free = np.einsum("ij,ij->i", self.normal[rows], towards) > 0
        tested = np.flatnonzero(free)
        free[tested] = ~self.rays.occluded(
            start[tested], towards[tested], None if limits is None else limits[tested]
        )
        return free.reshape(-1, count)

    def _to_disc(self, rows: NDArray, share: Array, angle: Array) -> tuple[Array, Array]:
        """((m, 3) directions uniform over the light's solid angle, (m,) cosines to its axis)."""
        cosine = 1.0 - share * (1.0 - np.cos(self.radius[rows]))
        sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
        sideways = (sine * np.cos(angle))[:, None] * self.across[rows]
        sideways += (sine * np.sin(angle))[:, None] * self.along[rows]
        return cosine[:, None] * self.towards[rows] + sideways, cosine

    def _shift(self, rows: NDArray, share: Array, angle: Array) -> Array:
        """(m, 3) offsets of the starts: points of the uncertainty disc, projected along the light
        onto the tangent plane."""
        far = self.blur * np.sqrt(share)
        aside = (far * np.cos(angle))[:, None] * self.across[rows]
        aside += (far * np.sin(angle))[:, None] * self.along[rows]
        rise = np.einsum("ij,ij->i", self.normal[rows], aside)
        lean = np.einsum("ij,ij->i", self.normal[rows], self.towards[rows])
        back = rise / np.maximum(lean, MIN_COSINE)
        shifted: Array = aside - back[:, None] * self.towards[rows]
        return shifted


def to_grey(visible: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Grey values of a shadow mask for visibilities 0…1 of any shape: white means shadow.

    Masks are thresholded at one half, which must exclude every pixel that misses more than
    TOLERANCE of its light: missing 0…5 % is mapped to 0…127, missing 5…100 % to 128…255.
    """
    missing = np.clip(1.0 - np.asarray(visible, np.float64), 0.0, 1.0)
    little = 127.0 * missing / TOLERANCE
    much = 128.0 + 127.0 * (missing - TOLERANCE) / (1.0 - TOLERANCE)
    return np.round(np.where(missing <= TOLERANCE + 1e-6, np.minimum(little, 127), much)).astype(
        np.uint8
    )


def from_grey(grey: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Visibilities 0…1 from the grey values of a shadow mask; inverts to_grey up to rounding."""
    value = np.asarray(grey, np.float32)
    little = TOLERANCE * value / 127.0
    much = TOLERANCE + (1.0 - TOLERANCE) * (value - 128.0) / 127.0
    return np.asarray(1.0 - np.where(value < 128, little, much), np.float32)
