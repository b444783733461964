"""What the tables of a capture file say, one dataclass a table."""

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
    """A photo of a sphere. camera: label of the scan camera it was taken with; surface: "chrome" or
    "glossy"; reflectance: of a chrome one, which gives the light's irradiance; centre (2,) and
    radius: its outline, pixels; mask: or the sphere in white; neither: it is searched for."""

    photo: Path
    camera: str
    surface: str = "chrome"
    reflectance: float | None = None
    centre: Array | None = None
    radius: float | None = None
    mask: Path | None = None


@dataclass(frozen=True)
class SunEntry:
    """Where and when. latitude, longitude: degrees; altitude: metres; time: with its zone. north,
    up: (3,) scan frame. None: from the photos' EXIF, or the scan's georeference."""

    latitude: float | None = None
    longitude: float | None = None
    altitude: float | None = None
    time: datetime | None = None
    north: Array | None = None
    up: Array | None = None


@dataclass(frozen=True)
class WhiteEntry:
    """A white matte target in a photo. normal: (3,) scan frame; None: it faces the light. exposure:
    the photo's, in the unit of the lit photos' exposures."""

    photo: Path
    mask: Path
    reflectance: float
    normal: Array | None = None
    exposure: float | None = None


@dataclass(frozen=True)
class LightEntry:
    """One light: exactly one of direction, sphere, sun (distant), position (near), mounted.

    strength: (3,) irradiance of a distant light, intensity of a near one. angle: radians,
    diameter of a distant source as the object sees it; radius: of a near source, scan units; beam:
    radians to half of the intensity. refine: what is given is where the search starts. charted: the
    colour chart of [tone] says how strong it is."""

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
    charted: bool = False

    @property
    def strength_given(self) -> bool:
        """True where reflectance will have a scale."""
        mirror = self.sphere is not None and self.sphere.reflectance is not None
        return self.strength is not None or self.white is not None or mirror or self.charted

    @property
    def distant(self) -> bool:
        """True for a light that is the same everywhere."""
        return self.position is None and self.mounted is None


@dataclass(frozen=True)
class ChartEntry:
    """A photo of a colour chart or a grey scale. corners: (4, 2) pixels, the centres of its corner
    patches: dark skin, bluish green, black, white of a ColorChecker; first and last of a grey scale
    are corners[0] and corners[1]. reflectance: of a grey scale's patches, first to last. light:
    name of the distant light that shines on it, whose irradiance it then gives; normal: (3,) the
    chart's, scan frame; None: it faces that light."""

    photo: Path
    corners: Array
    reflectance: tuple[float, ...] | None = None
    light: str | None = None
    normal: Array | None = None


@dataclass(frozen=True)
class ToneEntry:
    """[tone]: from the photos' numbers to linear light. transfer: a curve by name; chart: or
    measured; "auto": as each file says."""

    transfer: str = "auto"
    chart: ChartEntry | None = None


@dataclass(frozen=True)
class PhotoEntry:
    """One lit photo, or several exposures of it. camera: label of the scan camera that shares its
    viewpoint; light: name of a light; exposures: divide the pixels of each file, None for EXIF's;
    transfer: a curve of its own; saturation: the linear value at which a float photo clips;
    masks: material (or "shadow") → mask file, white = in."""

    files: tuple[Path, ...]
    camera: str
    light: str
    exposures: tuple[float, ...] | None = None
    transfer: str | None = None
    saturation: float | None = None
    masks: dict[str, Path] = field(default_factory=dict)

    @property
    def file(self) -> Path:
        """The photo's name: its first file."""
        return self.files[0]


@dataclass(frozen=True)
class MaterialEntry:
    """One material to fit, by masks unless the mesh says where it is. faces: name of the mesh's
    integer face attribute (its value is the material's place in the list, from 0); vertex_colour,
    texture_colour: (3,) sRGB 0..255, painted on the mesh's vertices or in its texture."""

    name: str
    faces: str | None = None
    vertex_colour: tuple[int, int, int] | None = None
    texture_colour: tuple[int, int, int] | None = None

    @property
    def by_mesh(self) -> bool:
        """True where the mesh says which faces are of it."""
        return (self.faces or self.vertex_colour or self.texture_colour) is not None


@dataclass(frozen=True)
class FitOptions:
    """[fit]: what is too close to trust, and the estimator's settings. method: "measured" or
    "paper"; absolute: False where the lights' irradiance is known only relative to each other;
    unused: keys that were given and that the method does not read."""

    method: str = "measured"
    absolute: bool = True
    margins: Margins = field(default_factory=Margins)
    paper: PaperSettings = field(default_factory=PaperSettings)
    held_out: bool = True
    unused: tuple[str, ...] = ()
