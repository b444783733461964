"""The input of a diagnosis: pixels, fitted BRDFs, scan and lights of a capture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...geometry import RayScene
from .face_radiosity import face_radiosity
from .known_variation import KnownVariation
from .material_brdfs import MaterialBRDFs
from .pixels import Pixels
from .radiosity import visible_faces
from .rig import Rig
from .surroundings import Surroundings

Array = NDArray[np.floating]


@dataclass(frozen=True)
class DiagnosisContext:
    """The data that effects are built from.

    pixels: the pixels of all photos that the diagnosis uses. brdfs: of the fit without effects.
    rays: the scanned mesh. light: (photos,) index of the light of each photo. lights: their names;
    distant: (lights,) whether each is distant. rig: cameras and lamps of the photos. centre: (3,)
    of the visible surface; size: its extent, both in scan units. level: median irradiance. scale:
    (materials,) factor by which each material's reflectance was multiplied and the irradiance on it
    divided, where the irradiance is unknown. materials: their names. variation: of the materials
    over the surface, None where they are even. ray_count: rays per pixel and sampling strategy
    (surroundings.py). Few rays make a noisy regressor, which biases the estimated light towards
    zero (errors in variables): by one half at 20 rays, by one twentieth at 100.
    """

    pixels: Pixels
    brdfs: MaterialBRDFs
    rays: RayScene
    light: NDArray[np.intp]
    lights: tuple[str, ...]
    distant: NDArray[np.bool_]
    rig: Rig
    centre: NDArray[np.float64]
    size: float
    level: float
    scale: NDArray[np.float32]
    ray_count: int = 100
    materials: tuple[str, ...] = ()
    variation: KnownVariation | None = None

    @property
    def pixel_level(self) -> Array:
        """(n, 1) median irradiance, in the unit of each pixel's material."""
        return (self.level / self.scale[self.pixels.material])[:, None].astype(np.float32)

    @cached_property
    def surroundings(self) -> Surroundings:
        """The surroundings of the surface point of every pixel."""
        return Surroundings.of(self.pixels, self.brdfs, self.rays, self.ray_count)

    @cached_property
    def visible_faces(self) -> NDArray[np.int32]:
        """(f, directions) faces of the mesh that are visible from each face (radiosity.py)."""
        return visible_faces(self.rays)

    def face_radiosity(self, photo: int) -> Array:
        """(f, 3) radiance of every face of the mesh in a photo: a diffuse surface of the same
        albedo, lit by the lamp and by the other faces."""
        return face_radiosity(
            self.pixels, self.brdfs, self.rays, self.scale, self.visible_faces, photo
        )


@dataclass(frozen=True)
class NearestPixels:
    """For other pixels (m,) the nearest of the pixels that effects were built for. photo: (m,) the
    nearest in the same photo. surface: (m,) the nearest on the surface, in any photo."""

    photo: NDArray[np.intp]
    surface: NDArray[np.intp]

    def select(self, rows: NDArray[np.intp]) -> NearestPixels:
        """Some of the other pixels."""
        return NearestPixels(self.photo[rows], self.surface[rows])
