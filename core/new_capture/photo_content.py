"""Does a photo show the mesh from a camera, and from where was it lit?

A lit photo without a camera of its name may still have one: the light in it falls on the mesh only
from the right viewpoint. Each camera is tried with the coarse search of light_search. This needs a
dark background, as photos under one lamp in a dark room have.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from ..angles.vectors import even_directions
from ..errors import PatinaError
from ..geometry import RayScene
from ..geometry.pixel_hits import pixel_hits
from ..light import DistantLight
from ..light_search import LampPhoto, draw_lamp_pixels
from ..light_search.brdf_dictionary import BrdfDictionary
from ..light_search.materials import own_materials
from ..light_search.shading import LampPixels, predicted
from ..scan import Camera

Array = NDArray[np.float64]

OUTLINE_PIXELS = 160  # longer side of the pictures that outlines are compared in
LIT_LEVEL = 0.03  # of the photo's 99.5th percentile: a brighter pixel is lit
DARK_LEVEL = 0.02  # a darker one is background or shadow
MIN_DARK_SHARE = 0.15  # of the pixels, for a dark background
MAX_OUTSIDE = 0.04  # of the lit pixels may be outside the mesh: holes and errors of the scan
TRIED_CAMERAS = 12  # whose outline fits best
PIXELS, DIRECTIONS = 500, 200
MIN_MARGIN = 1.15  # the second best camera's cost must be so much larger
MAX_COST = 0.2  # of a match. The true cameras of 31 of 32 photos of four scans: 0.01 to 0.15, one
# 0.38; the best wrong camera of each: 0.08 to 0.5


@dataclass(frozen=True)
class Picture:
    """A photo reduced in size. level: (h, w) mean of the channels; unit: its 99.5th percentile."""

    level: NDArray[np.float32]
    unit: float

    @classmethod
    def of(cls, radiance: NDArray[np.float32]) -> Picture:
        """From the radiance (h, w, 3) of a whole photo."""
        grey = radiance.mean(axis=2)
        step = max(int(np.ceil(max(grey.shape) / OUTLINE_PIXELS)), 1)
        height, width = (n // step * step for n in grey.shape)
        blocks = grey[:height, :width].reshape(height // step, step, width // step, step)
        level = np.maximum(np.nan_to_num(blocks.mean(axis=(1, 3)), posinf=0.0), 0)
        return cls(level, max(float(np.percentile(level, 99.5)), 1e-30))

    @property
    def shape(self) -> tuple[int, int]:
        """(h, w)."""
        return self.level.shape[0], self.level.shape[1]

    @property
    def lit(self) -> NDArray[np.bool_]:
        """(h, w) pixels that are lit."""
        return self.level > LIT_LEVEL * self.unit

    @property
    def dark_background(self) -> bool:
        """Whether much of the photo is dark, so that lit pixels are the object."""
        return float((self.level < DARK_LEVEL * self.unit).mean()) > MIN_DARK_SHARE


def outline(camera: Camera, shape: tuple[int, int], rays: RayScene) -> NDArray[np.bool_]:
    """(h, w) pixels that show the mesh from a camera, or whose neighbours do."""
    height, width = shape
    rows, columns = np.indices(shape) + 0.5
    across, down = camera.width / width, camera.height / height
    centres = np.stack([columns.ravel() * across, rows.ravel() * down], axis=1)
    hit = pixel_hits(rays, camera, centres).hit
    return np.asarray(binary_dilation(hit.reshape(shape), np.ones((3, 3), bool)))


def outside_share(picture: Picture, seen: NDArray[np.bool_]) -> float:
    """Share of the photo's lit pixels outside an outline (h, w)."""
    lit = picture.lit
    return float((lit & ~seen).sum() / max(lit.sum(), 1))


def content_costs(
    radiance: NDArray[np.float32],
    usable: NDArray[np.bool_],
    cameras: Sequence[Camera],
    outlines: Callable[[tuple[int, int]], Sequence[NDArray[np.bool_]]],
    rays: RayScene,
    dictionary: BrdfDictionary,
) -> Generator[float, None, dict[str, float]]:
    """Label → how badly the mesh, lit by one distant lamp, explains the photo from the cameras
    whose outlines fit best; {} where the background is not dark or none fits. Yields the fraction
    done.

    radiance: (h, w, 3); usable: (h, w); outlines: shape → outline of each camera. A cost is the
    mean capped |log residual| + the share of lit pixels outside the mesh.
    """
    picture = Picture.of(radiance)
    if not picture.dark_background:
        return {}
    outside = np.array([outside_share(picture, seen) for seen in outlines(picture.shape)])
    height, width = usable.shape
    order = [
        i
        for i in np.argsort(outside, kind="stable")
        if outside[i] < MAX_OUTSIDE and fits_size(cameras[i], width, height)
    ]
    found: dict[str, float] = {}
    for done, index in enumerate(order[:TRIED_CAMERAS]):
        yield done / min(len(order), TRIED_CAMERAS)
        camera = cameras[index].resized(width, height)
        cost = lit_cost(camera, radiance, usable, rays, dictionary)
        found[cameras[index].label] = cost + outside[index]
    return found


def best_match(costs: Mapping[str, float]) -> str | None:
    """The camera with the lowest cost; None where none fits, or two fit equally well."""
    order = sorted(costs, key=costs.__getitem__)
    if not order or costs[order[0]] > MAX_COST:
        return None
    if len(order) > 1 and costs[order[1]] < MIN_MARGIN * costs[order[0]]:
        return None
    return order[0]


def refutes(costs: Mapping[str, float], label: str) -> bool:
    """Whether another camera explains the photo clearly better than the camera of a label."""
    return bool(costs) and costs.get(label, np.inf) > MIN_MARGIN * min(costs.values())


def fits_size(camera: Camera, width: int, height: int) -> bool:
    """Whether a photo of this size may be a scaled copy of the camera's."""
    try:
        camera.resized(width, height)
    except PatinaError:
        return False
    return True


def lit_cost(
    camera: Camera,
    radiance: NDArray[np.float32],
    usable: NDArray[np.bool_],
    rays: RayScene,
    dictionary: BrdfDictionary,
) -> float:
    """The cost of the photo from a camera, under the distant light that explains it best."""
    material = np.where(usable, 0, -1).astype(np.int16)
    photo = draw_lamp_pixels(rays, camera, radiance, material, PIXELS, np.random.default_rng(0))
    if len(photo.radiance) < PIXELS // 10 or not (photo.radiance > 0).any():
        return 1.0
    return best_direction(photo, rays, dictionary)[1]


def best_direction(
    photo: LampPhoto, rays: RayScene, dictionary: BrdfDictionary
) -> tuple[Array, float]:
    """((3,) direction, cost) of the best of DIRECTIONS candidates."""
    pixels = LampPixels.of([photo], len(photo.radiance))
    best, cost = np.array([0.0, 0.0, 1.0]), np.inf
    for direction in even_directions(DIRECTIONS):
        values = pixels.dictionary_radiance(DistantLight("", direction), rays, dictionary)
        own = own_materials(pixels, values, 1)
        this = pixels.measured.cost(predicted(values, own, pixels.material))
        if this < cost:
            best, cost = direction, this
    return best, float(cost)
