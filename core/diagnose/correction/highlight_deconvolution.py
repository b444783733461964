"""What a lamp's size or a brushed surface does to highlights, taken back a pass at a time.

What a wide lamp blurs nobody sees, and what is sharpened all the way is noise: a spike of a degree
under a lamp of 24° is as good as none. So samples are multiplied by what the BRDF of the fit before
reflects of a point over what it reflects of the lamp (Richardson 1972, Lucy 1974), beginning with
the blurred one, and whoever does so stops early: as soon as photos that a fit has not seen, which
are predicted blurred again, are predicted no better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...basis import PrincipalBRDF
from ...fit.held_out import LeftOut, compared
from ...samples import SampleTable
from ..effects.base.capabilities import WidensHighlights
from ..effects.base.image_formation import changes_lamp_light
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.shading_state import ShadingState
from ..solver.model import Model

Array = NDArray[np.floating]

FARTHEST = 3.0  # factor by which a prediction may correct


@dataclass(frozen=True)
class BlurredPhoto:
    """Samples of one photo. model: of pixels of one material, with what changes surface and lamp
    alone; rows: those of them that are samples."""

    photo: int
    model: Model
    rows: NDArray[np.intp]

    @cached_property
    def now(self) -> ShadingState:
        """Of all its model's pixels; no BRDF changes it."""
        return self.model.shading()

    def shown(self, brdfs: MaterialBRDFs) -> Array:
        """(rows, 3) radiance as it is, of the lamp's light."""
        model = replace(self.model, brdfs=brdfs)
        return model.reflected(model.lamp_parts(self.now))[self.rows]

    def of_point(self, brdfs: MaterialBRDFs) -> Array:
        """(rows, 3) radiance of a point lamp's light on a surface that is not brushed."""
        return brdfs.reflected(replace(self.now, stretch=None))[self.rows]


@dataclass(frozen=True)
class HighlightBlur:
    """Of all samples of a material, in their order."""

    parts: tuple[BlurredPhoto, ...]

    def sharpened(self, table: SampleTable, brdf: PrincipalBRDF) -> SampleTable:
        """Those of the samples that a prediction may correct so far. table: as the photos show
        them; brdf: of the fit before."""
        brdfs = MaterialBRDFs.without_slack(brdf)
        point = np.concatenate([part.of_point(brdfs) for part in self.parts])
        blurred_photo = np.concatenate([part.shown(brdfs) for part in self.parts])
        ratio = (point / np.maximum(blurred_photo, 1e-30)).astype(np.float32)
        rows = np.flatnonzero(((ratio < FARTHEST) & (ratio > 1 / FARTHEST)).all(axis=1))
        ratio = ratio[rows]
        found = table.select(rows)
        return replace(
            found,
            rho=found.rho * ratio,
            radiance=found.radiance * ratio,
            response=found.response / ratio,
        )

    def left_out(self, table: SampleTable, photo: int, brdf: PrincipalBRDF) -> LeftOut:
        """How well a BRDF that was found without a photo predicts it as it is, blurred."""
        brdfs = MaterialBRDFs.without_slack(brdf)
        shown = np.concatenate([part.shown(brdfs) for part in self.parts if part.photo == photo])
        held = table.select(table.photo == photo)
        return compared(photo, shown[held.read], held.select(held.read))


def widens_highlights(model: Model) -> bool:
    """Whether highlights are wider in it than its materials make them."""
    return any(isinstance(effect, WidensHighlights) for effect in model.effects)


def blurred_photo(photo: int, model: Model, rows: NDArray[np.intp]) -> BlurredPhoto:
    """Of a model of pixels of one photo and material with all effects."""
    both = zip(model.effects, model.x, strict=True)
    effects, x = zip(*((e, x) for e, x in both if changes_lamp_light(e)), strict=True)
    alone = replace(model.pixels, material=np.zeros_like(model.pixels.material))
    return BlurredPhoto(photo, Model(alone, model.brdfs, effects, x), rows)
