"""How much of its light each surface point sees: shadows with the soft edges that a source's size
and an uncertain mesh give them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..angles.vectors import tangents
from ..geometry import RayScene, SurfaceView
from ..light import DistantLight, Light
from ..scan import Camera, Mesh

Array = NDArray[np.float64]

SAMPLES = 64  # rays of a pixel in a soft edge: steps of 1.6 %
RAYS_AT_ONCE = 1 << 18
# Of the median edge. Two dense stereo meshes whose truth is known lie 0.08 and 0.04 of an edge off
# (median), 0.23 and 0.14 at the 95th percentile
UNCERTAINTY = 0.25
LEAST_COSINE = 0.2  # a shifted start goes along the surface, at grazing light not endlessly far
GOLDEN_ANGLE = np.pi * (3.0 - 5.0**0.5)
TOLERANCE = 0.05  # a pixel that misses more of its light than this is out


def mesh_uncertainty(mesh: Mesh) -> float:
    """How far off the mesh's outlines are taken to be, scan units: a quarter of its median edge."""
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
    """(n,) the fraction, 0…1, of the light's disc that every pixel's point of ``view`` sees.

    A distant light is a disc of its angular radius in the sky, a near or mounted one a sphere of
    its radius; what of it lies below the horizon of the smooth normal is not seen. uncertainty:
    scan units (None: mesh_uncertainty). Rays start at points of a disc of this radius around the
    pixel's point, square to the light and laid along it onto the tangent plane: as if the occluder
    were shifted by as much, so a hard edge becomes a ramp of ± uncertainty whatever its distance.

    Points on the discs are a spiral, turned by a hash of the pixel so that its pattern does not
    show. Where twelve rays on the discs' rims and within agree, no others are cast. Without any
    size this is one ray: exactly what cast_shadow says.
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
    """(n,) radians of the source, as each point sees it."""
    if distance is None:
        return np.full(count, light.angular_radius if isinstance(light, DistantLight) else 0.0)
    size = float(getattr(light, "radius", 0.0))
    return np.arcsin(np.clip(size / np.maximum(distance, 1e-12), 0.0, 1.0))


def _spiral(samples: int) -> Array:
    """(samples, 4): share of the light's disc and angle in it, the same in the disc of starts.

    Vogel's spiral fills the first disc; the second one's shares and angles step by other irrational
    numbers (Roberts 2018, the plastic number), so that the two know nothing of each other.
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
    """Rays on the rim of both discs, and some within: a straight edge that passes between eight
    on the rim leaves 1.2 % of the disc."""
    angle = 2 * np.pi * np.concatenate([np.arange(rim) / rim, (np.arange(inner) + 0.5) / inner])
    share = np.where(np.arange(rim + inner) < rim, 1.0, 0.2)
    return np.stack([share, angle, share, angle], axis=1)


SCOUTS = _scouts()


def _hashed_turn(pixel: NDArray[np.int32]) -> Array:
    """(n,) radians: a turn of its own for every pixel (Knuth's multiplicative hash)."""
    mixed = (pixel.astype(np.uint64) * np.uint64(2654435761)) & np.uint64(0xFFFFFFFF)
    mixed ^= mixed >> np.uint64(15)
    mixed = (mixed * np.uint64(2246822519)) & np.uint64(0xFFFFFFFF)
    return mixed.astype(np.float64) * (2 * np.pi / 2**32)


class _Points:
    """Some surface points, how their light stands, and who of it gets through."""

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
        # two axes square to the light
        self.across, self.along = tangents(towards)

    def seen(self, samples: int) -> NDArray[np.float32]:
        """(n,) fraction of the light, from ``samples`` rays where it takes as many."""
        every = np.arange(len(self.point))
        if samples == 1:
            return self._open(every, None)[:, 0].astype(np.float32)
        free = self._open(every, SCOUTS).mean(axis=1)
        mixed = np.flatnonzero((free > 0) & (free < 1))
        if len(mixed):
            free[mixed] = self._open(mixed, _spiral(samples)).mean(axis=1)
        return free.astype(np.float32)

    def _open(self, which: NDArray, pattern: Array | None) -> NDArray[np.bool_]:
        """(points, rays) whether rays of these points reach the light; None: one to its middle."""
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
        asked = np.flatnonzero(free)
        free[asked] = ~self.rays.occluded(
            start[asked], towards[asked], None if limits is None else limits[asked]
        )
        return free.reshape(-1, count)

    def _to_disc(self, rows: NDArray, share: Array, angle: Array) -> tuple[Array, Array]:
        """(directions (m, 3) evenly over the source's solid angle, cosines to its middle (m,))."""
        cosine = 1.0 - share * (1.0 - np.cos(self.radius[rows]))
        sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
        sideways = (sine * np.cos(angle))[:, None] * self.across[rows]
        sideways += (sine * np.sin(angle))[:, None] * self.along[rows]
        return cosine[:, None] * self.towards[rows] + sideways, cosine

    def _shift(self, rows: NDArray, share: Array, angle: Array) -> Array:
        """(m, 3) from the point to one of the disc of the mesh's uncertainty, on its plane."""
        far = self.blur * np.sqrt(share)
        aside = (far * np.cos(angle))[:, None] * self.across[rows]
        aside += (far * np.sin(angle))[:, None] * self.along[rows]
        rise = np.einsum("ij,ij->i", self.normal[rows], aside)
        lean = np.einsum("ij,ij->i", self.normal[rows], self.towards[rows])
        back = rise / np.maximum(lean, LEAST_COSINE)
        shifted: Array = aside - back[:, None] * self.towards[rows]
        return shifted


def to_grey(visible: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Grey of a shadow mask for visibilities 0…1 of any shape: white in shadow, black in the light.

    Whoever reads masks by "above one half" must leave out every pixel that misses more than
    TOLERANCE of its light: missing 0…5 % is 0…127, missing 5…100 % is 128…255.
    """
    missing = np.clip(1.0 - np.asarray(visible, np.float64), 0.0, 1.0)
    little = 127.0 * missing / TOLERANCE
    much = 128.0 + 127.0 * (missing - TOLERANCE) / (1.0 - TOLERANCE)
    return np.round(np.where(missing <= TOLERANCE + 1e-6, np.minimum(little, 127), much)).astype(
        np.uint8
    )


def from_grey(grey: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Visibilities of a shadow mask's grey; the inverse of to_grey within half a step."""
    value = np.asarray(grey, np.float32)
    little = TOLERANCE * value / 127.0
    much = TOLERANCE + (1.0 - TOLERANCE) * (value - 128.0) / 127.0
    return np.asarray(1.0 - np.where(value < 128, little, much), np.float32)
