"""Deconvolution of highlights that a large lamp or a brushed surface blurs, one pass at a time.

Detail much narrower than the lamp is not recoverable, and full deconvolution amplifies noise. So
samples are multiplied by the ratio of the prediction under a point lamp to the prediction under the
real lamp, both with the BRDF of the previous fit, starting with the blurred one (Richardson 1972,
Lucy 1974). The caller stops early: as soon as held-out photos, which are predicted with the blur,
are not predicted better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...basis import PrincipalBRDF
from ...fit.held_out import HeldOutPhoto, errors_of_radiance
from ...samples import SampleTable
from ..effects.base.capabilities import WidensHighlights
from ..effects.base.image_formation import changes_lamp_light
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.shading_state import ShadingState
from ..solver.model import Model

Array = NDArray[np.floating]

MAX_RATIO = 3.0  # factor by which a sample may be corrected


@dataclass(frozen=True)
class BlurredPhoto:
    """Samples of one photo. model: of pixels of one material, with only the effects that change
    surface and lamp. rows: indices of the pixels that are samples."""

    photo: int
    model: Model
    rows: NDArray[np.intp]

    @cached_property
    def now(self) -> ShadingState:
        """Shading state of all pixels of the model; it does not depend on the BRDF."""
        return self.model.shading()

    def shown(self, brdfs: MaterialBRDFs) -> Array:
        """(r, 3) reflected radiance of the lamp, with the blur."""
        model = replace(self.model, brdfs=brdfs)
        return model.reflected(model.lamp_parts(self.now))[self.rows]

    def of_point(self, brdfs: MaterialBRDFs) -> Array:
        """(r, 3) reflected radiance of a point lamp on an isotropic surface."""
        return brdfs.reflected(replace(self.now, stretch=None))[self.rows]


@dataclass(frozen=True)
class HighlightBlur:
    """The blur of the highlights of all samples of a material, in their order."""

    parts: tuple[BlurredPhoto, ...]

    def sharpened(self, table: SampleTable, brdf: PrincipalBRDF) -> SampleTable:
        """The samples after one pass, without those whose correction exceeds MAX_RATIO. table: the
        samples as in the photos; brdf: of the previous fit."""
        brdfs = MaterialBRDFs.without_slack(brdf)
        point = np.concatenate([part.of_point(brdfs) for part in self.parts])
        blurred_photo = np.concatenate([part.shown(brdfs) for part in self.parts])
        ratio = (point / np.maximum(blurred_photo, 1e-30)).astype(np.float32)
        rows = np.flatnonzero(((ratio < MAX_RATIO) & (ratio > 1 / MAX_RATIO)).all(axis=1))
        ratio = ratio[rows]
        found = table.select(rows)
        return replace(
            found,
            rho=found.rho * ratio,
            radiance=found.radiance * ratio,
            variance=found.variance * ratio**2,
            response=found.response / ratio,
        )

    def predict_held_out(self, table: SampleTable, photo: int, brdf: PrincipalBRDF) -> HeldOutPhoto:
        """How well a BRDF that was fitted without a photo predicts it, with the blur."""
        brdfs = MaterialBRDFs.without_slack(brdf)
        shown = np.concatenate([part.shown(brdfs) for part in self.parts if part.photo == photo])
        held = table.select(table.photo == photo)
        return errors_of_radiance(photo, shown[held.read], held.select(held.read))


def widens_highlights(model: Model) -> bool:
    """Whether an effect of the model widens highlights."""
    return any(isinstance(effect, WidensHighlights) for effect in model.effects)


def blurred_photo(photo: int, model: Model, rows: NDArray[np.intp]) -> BlurredPhoto:
    """The blur of one photo. model: with all effects, for pixels of one photo and material."""
    both = zip(model.effects, model.x, strict=True)
    effects, x = zip(*((e, x) for e, x in both if changes_lamp_light(e)), strict=True)
    alone = replace(model.pixels, material=np.zeros_like(model.pixels.material))
    return BlurredPhoto(photo, Model(alone, model.brdfs, effects, x), rows)
