"""One way in which the forward model may be wrong: what it adds, with which numbers.

A photo comes about in three steps, and an effect may have a part in each: surface and light as they
really are (``before``), light that reaches the pixel beside that of the lamp (``added``), and what
the camera makes of it (``after``).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..geometry import RayScene
from .brdfs import BRDFs
from .pixels import Pixels
from .situation import Situation

if TYPE_CHECKING:
    from .surroundings import Surroundings

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Numbers:
    """The unknowns of an effect; all are 0 where there is no effect. names, units: (p,).
    deviation: (p,) what is usual, of a Gaussian prior. low, high: (p,). step: (p,) for
    derivatives. start: (p,) where the search begins, None: at 0."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    deviation: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    step: NDArray[np.float64]
    start: NDArray[np.float64] | None = None

    @classmethod
    def alike(
        cls,
        names: Sequence[str],
        unit: str,
        deviation: float,
        low: float = -np.inf,
        high: float = np.inf,
        step: float = 1e-3,
        start: float = 0.0,
    ) -> Numbers:
        """Unknowns of one kind."""
        p = len(names)
        return cls(
            tuple(names), (unit,) * p, np.full(p, deviation), np.full(p, low), np.full(p, high),
            np.full(p, step), np.full(p, start),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.names)

    @property
    def begin(self) -> NDArray[np.float64]:
        """(p,) where the search begins."""
        return np.zeros(len(self)) if self.start is None else self.start.copy()


@dataclass(frozen=True)
class Near:
    """Of other pixels (m,) the nearest of those that effects were made for: (m,) in the same photo,
    and (m,) on the surface, in whatever photo."""

    photo: NDArray[np.intp]
    surface: NDArray[np.intp]

    def select(self, rows: NDArray[np.intp]) -> Near:
        """Of some of them."""
        return Near(self.photo[rows], self.surface[rows])


@dataclass(frozen=True)
class Setting:
    """What effects are made for. light: (photos,) which of the lights lit each. lights: their
    names; distant: which of them are. centre: (3,) of what the photos show; size: its extent, scan
    units. level: typical irradiance. scale: (materials,) what each material's reflectance was
    multiplied by, and irradiance on it divided by, where that is not known; materials: their
    names. brdfs: before any effect. rays: the scan's mesh. sights: directions of either kind
    (surroundings.py) that a pixel looks into: what sums over too few of them are off by is no
    light, and dilutes what is found of the light that is there (of a bounce half at 20, a twentieth
    at 100)."""

    pixels: Pixels
    brdfs: BRDFs
    rays: RayScene
    light: NDArray[np.intp]
    lights: tuple[str, ...]
    distant: NDArray[np.bool_]
    centre: NDArray[np.float64]
    size: float
    level: float
    scale: NDArray[np.float32]
    sights: int = 100
    materials: tuple[str, ...] = ()

    @property
    def own_level(self) -> Array:
        """(n, 1) typical irradiance, in the unit of each pixel's material."""
        return (self.level / self.scale[self.pixels.material])[:, None].astype(np.float32)

    @cached_property
    def surroundings(self) -> Surroundings:
        """What every pixel's point sees around itself."""
        from .surroundings import Surroundings

        return Surroundings.of(self)

    @cached_property
    def faces_seen(self) -> NDArray[np.int32]:
        """(f, directions) faces of the mesh that each face of it sees (exchange.py)."""
        from .exchange import faces_seen

        return faces_seen(self.rays)

    def glow(self, photo: int) -> Array:
        """(f, 3) radiance that every face of the mesh sends off in a photo, as a matte surface of
        the same albedo would, of the lamp's light and of what other faces send off."""
        from .glow import face_glow

        return face_glow(self, photo)


def without_mean(count: int, each: int, place: int) -> NDArray[np.float64]:
    """(count · each,)²: takes the mean of the numbers at ``place`` of all copies from them."""
    out = np.eye(count * each)
    at = np.arange(count) * each + place
    out[np.ix_(at, at)] -= 1 / count
    return out


def felt_by(copy: NDArray[np.intp], each: int) -> NDArray[np.intp]:
    """(n, each) for numbers of which every photo (light, patch) has its own: copy: (n,) whose each
    pixel feels, −1 none."""
    return np.where(copy[:, None] >= 0, copy[:, None] * each + np.arange(each), -1)


class Effect(ABC):
    """One cause of the vocabulary, made for the pixels that it is to explain."""

    cause: str
    proof: str  # the photo that would tell it from others
    of_highlights = False  # whether it changes nothing else
    fine = False  # judged on single pixels of the photos: only those beside one tell of it
    of_photo = False  # whether it needs what the photo shows about a pixel
    accuracy = 0.0  # what its own sums may be off by, relative
    blurs = False  # whether it makes highlights wider than the material does
    of_camera = False  # whether the camera does it, which knows nothing of materials
    of_brdf = False  # whether it is made of the BRDFs, and made anew when they are known better

    @classmethod
    @abstractmethod
    def of(cls, setting: Setting) -> Effect | None:
        """For a capture; None where it cannot be there."""

    def elsewhere(self, setting: Setting, near: Near) -> Effect | None:
        """The same for other pixels (m,), of which the same numbers speak; near: the nearest of the
        pixels that the effect was made for. None where it does nothing."""
        return type(self).of(setting)

    @property
    @abstractmethod
    def numbers(self) -> Numbers:
        """The unknowns."""

    @property
    def anchor(self) -> NDArray[np.float64] | None:
        """(p, p) what is told of the numbers: a part of them that the BRDF could as well have, as
        the mean of all gains, is left out, since the capture says how bright the light is. None:
        all of them."""
        return None

    def told(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(p,) the numbers without that part."""
        return x if self.anchor is None else self.anchor @ x

    def own_error(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(p,) what numbers x may be off by for what the effect's own sums leave out."""
        return self.accuracy * np.abs(x)

    @property
    def beginnings(self) -> Sequence[Effect]:
        """The same from other places, where one does not tell of all sizes of it."""
        return (self,)

    def guess(self, missed: Array, shown: Array) -> NDArray[np.float64]:
        """Where the search begins; missed: (n, 3) what the photos show more than the model without
        the effect, which predicts shown, (n, 3); 0 where that is dark. What is far off counts as an
        outlier to a robust fit, and would never be reached from afar."""
        return self.numbers.begin

    def expecting(self, usual: NDArray[np.float64]) -> Effect:
        """The same, where numbers of a patch (e,) usually have this deviation."""
        return self

    @property
    def patch(self) -> NDArray[np.intp] | None:
        """(n,) of an effect whose numbers are many, each felt by a patch of pixels only: which
        patch each is in, −1 none. Its numbers follow patch by patch."""
        return None

    def worth(self, x: NDArray[np.float64]) -> bool:
        """Whether so much of it is worth a word."""
        return True

    @property
    def freedom(self) -> int:
        """How many things it can be."""
        return len(self.numbers)

    def loosened(self, brdfs: BRDFs) -> BRDFs:
        """The BRDFs as free as the effect lets them be."""
        return brdfs

    @property
    def feels(self) -> NDArray[np.intp] | None:
        """(n, s) places of the numbers that each pixel feels, −1 none, such that none feels two of
        one slot; None: all pixels feel all numbers."""
        if self.patch is None:
            return None
        return felt_by(self.patch, len(self.numbers) // (int(self.patch.max()) + 1))

    @property
    def lights(self) -> bool:
        """Whether it changes surface or lamp, and so what the surface reflects of the lamp."""
        kind = type(self)
        return kind.before is not Effect.before or kind.lamps is not Effect.lamps

    def remade(self, setting: Setting, x: NDArray[np.float64]) -> Effect:
        """Where it is made of_brdf: the same of the setting's BRDFs, x: as it was found with
        others."""
        effect = type(self).of(setting)
        assert effect is not None
        return effect

    def casting(self, setting: Setting, x: NDArray[np.float64]) -> Effect:
        """The same, with rays cast anew: shadows away from where these numbers put the lamp, the
        surface that photos show where they lie elsewhere. Found once the effect is accepted, since
        rays take long. Most move neither."""
        return self

    def sought(
        self,
        setting: Setting,
        x: NDArray[np.float64],
        shown: Callable[[Effect, NDArray[np.float64]], Array],
    ) -> NDArray[np.float64]:
        """(p,) where rays should be cast for, from numbers x that slopes led to: they may lead to
        the nearest place that looks alike. shown: (n, 3) by the model with an effect and numbers of
        it, the BRDFs as they were found."""
        return x

    def before(self, now: Situation, x: NDArray[np.float64]) -> Situation:
        """Surface and light with the effect."""
        return now

    def lamps(self, now: Situation, x: NDArray[np.float64]) -> list[Situation]:
        """Equal parts of a lamp that has a size."""
        return [now]

    def added(self, now: Situation, brdfs: BRDFs, x: NDArray[np.float64]) -> Array | None:
        """(n, 3) radiance beside the lamp's."""
        return None

    def after(self, radiance: Array, now: Situation, x: NDArray[np.float64]) -> Array:
        """(n, 3) what the camera says of this radiance."""
        return radiance

    @abstractmethod
    def sentence(self, x: NDArray[np.float64], deviation: NDArray[np.float64]) -> str:
        """For an artist."""
