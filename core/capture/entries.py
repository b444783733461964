"""The tables of a capture file as dataclasses, one per table."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..fit import PaperSettings
from ..samples import Margins

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SphereEntry:
    """A photo of a sphere. camera: label of the scan camera with its viewpoint; surface: "chrome"
    or "glossy"; reflectance: of a chrome sphere, gives the light's irradiance; centre (2,) and
    radius: the outline in pixels; mask: an image with the sphere in white. Without outline and
    mask the sphere is searched for."""

    photo: Path
    camera: str
    surface: str = "chrome"
    reflectance: float | None = None
    centre: Array | None = None
    radius: float | None = None
    mask: Path | None = None


@dataclass(frozen=True)
class SunEntry:
    """Place and time of a photo lit by the sun. latitude, longitude: degrees; altitude: metres;
    time: with time zone; north, up: (3,) scan frame. None: from the photo's EXIF or from the
    scan's georeference."""

    latitude: float | None = None
    longitude: float | None = None
    altitude: float | None = None
    time: datetime | None = None
    north: Array | None = None
    up: Array | None = None


@dataclass(frozen=True)
class WhiteEntry:
    """A white matte target in a photo. normal: (3,) scan frame; None: it faces the light. exposure:
    of the photo, in the unit of the lit photos' exposures."""

    photo: Path
    mask: Path
    reflectance: float
    normal: Array | None = None
    exposure: float | None = None


@dataclass(frozen=True)
class LightEntry:
    """One light: exactly one of direction, sphere, sun (distant), position (near), mounted.

    strength: (3,) irradiance of a distant light, or intensity of a near one. angle: radians,
    angular diameter of a distant source; radius: of a near source, scan units; beam: radians, angle
    from the axis at which half of the intensity is left. refine: the given values are start values
    of an optimisation. guess: the direction or position is a placeholder that was not measured.
    standard_error: of the direction (radians), or of the position or offset (scan units), where it
    was found from photos. relative_strength: where no strength is known, that relative to the other
    lights. charted: the colour chart of [tone] gives the strength."""

    name: str
    direction: Array | None = None
    sphere: SphereEntry | None = None
    sun: SunEntry | None = None
    position: Array | None = None
    mounted: Array | None = None
    strength: Array | None = None
    white: WhiteEntry | None = None
    angle: float | None = None
    radius: float = 0.0
    beam: float | None = None
    refine: bool = False
    guess: bool = False
    standard_error: float | None = None
    relative_strength: float | None = None
    charted: bool = False

    @property
    def strength_given(self) -> bool:
        """True where the entry fixes the light's strength, so that reflectance has a scale."""
        mirror = self.sphere is not None and self.sphere.reflectance is not None
        return self.strength is not None or self.white is not None or mirror or self.charted

    @property
    def distant(self) -> bool:
        """True for a light with the same direction and irradiance everywhere on the object."""
        return self.position is None and self.mounted is None


@dataclass(frozen=True)
class ChartEntry:
    """A photo of a colour chart or a grey scale.

    corners: (4, 2) pixels, centres of a ColorChecker's corner patches (dark skin, bluish green,
    black, white); for a grey scale (2, 2), its first and last patch. reflectance: of a grey
    scale's patches, first to last. light: name of the distant light whose irradiance the chart
    gives; normal: (3,) of the chart, scan frame; None: it faces that light.
    """

    photo: Path
    corners: Array
    reflectance: tuple[float, ...] | None = None
    light: str | None = None
    normal: Array | None = None


@dataclass(frozen=True)
class ToneEntry:
    """[tone]: how pixel values are converted to linear light. transfer: name of a curve; "auto":
    the curve that each file states; chart: measures the curve instead."""

    transfer: str = "auto"
    chart: ChartEntry | None = None


@dataclass(frozen=True)
class PhotoEntry:
    """One lit photo, or several exposures of it.

    camera: label of the scan camera with its viewpoint; light: name of its light; exposures: one
    per file, the pixels are divided by it; None: from EXIF. transfer: curve of this photo, None for
    that of [tone]. saturation: linear value at which a floating-point photo clips. masks:
    {material or "shadow", "highlight", "ignore": mask file}, white = inside.
    """

    files: tuple[Path, ...]
    camera: str
    light: str
    exposures: tuple[float, ...] | None = None
    transfer: str | None = None
    saturation: float | None = None
    masks: dict[str, Path] = field(default_factory=dict)

    @property
    def file(self) -> Path:
        """The first file, which names the photo."""
        return self.files[0]


@dataclass(frozen=True)
class MaterialEntry:
    """One material to fit, located by masks unless one of these locates it on the mesh.

    faces: name of an integer face attribute (its value is the material's index, from 0);
    vertex_colour, texture_colour: (3,) sRGB 0..255, painted on the vertices or in the texture.
    """

    name: str
    faces: str | None = None
    vertex_colour: tuple[int, int, int] | None = None
    texture_colour: tuple[int, int, int] | None = None

    @property
    def by_mesh(self) -> bool:
        """True where faces or colours of the mesh locate the material."""
        return (self.faces or self.vertex_colour or self.texture_colour) is not None


@dataclass(frozen=True)
class FitOptions:
    """[fit]: the margins and the settings of the estimator.

    method: "measured" or "paper"; absolute: False where the lights' irradiance is known only
    relative to each other; margins: distances within which pixels are rejected; held_out: whether
    photos are held out for cross-validation; unused: given keys that the method does not read.
    """

    method: str = "measured"
    absolute: bool = True
    margins: Margins = field(default_factory=Margins)
    paper: PaperSettings = field(default_factory=PaperSettings)
    held_out: bool = True
    unused: tuple[str, ...] = ()
