"""A material to be exported, with the representations that several formats share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ..appearance.lobe_fit import LobeStackFit, fit_lobe_stack
from ..appearance.open_pbr.fit import OpenPBRFit, fit_open_pbr
from ..appearance.principled_fit import PrincipledFit, fit_principled
from ..brdf import TabulatedBRDF
from ..concurrency.thread_pool import single_threaded_blas
from ..result import FittedMaterial
from .file_names import identifier
from .gltf_model import GLTF
from .losses import Evaluate, cube_root_error
from .measured_bsdf import MeasuredPictures, pictures
from .preview_surface import PREVIEW_SURFACE


@dataclass(frozen=True)
class Subject:
    """A fitted material with derived representations, computed on first use. Their fits run with
    one thread of BLAS: the last digits of its sums depend on the number, and so would the files."""

    material: FittedMaterial

    @property
    def name(self) -> str:
        """The name in the capture."""
        return self.material.name

    @property
    def id(self) -> str:
        """The identifier for file names and formats."""
        return identifier(self.material.name)

    @cached_property
    def table(self) -> TabulatedBRDF:
        """The BRDF at the centres of the MERL cells."""
        return self.material.brdf.table()

    @cached_property
    def lobes(self) -> LobeStackFit:
        """The best-fitting lobe stacks."""
        return fit_lobe_stack(self.material.brdf.evaluate)

    @cached_property
    def open_pbr(self) -> OpenPBRFit:
        """The closest OpenPBR surface."""
        with single_threaded_blas():
            return fit_open_pbr(self.material.brdf.evaluate, self.material.principled)

    @cached_property
    def gltf(self) -> PrincipledFit:
        """The inputs of the Principled BSDF that are closest in glTF viewers."""
        with single_threaded_blas():
            return fit_principled(self.material.brdf.evaluate, shown=GLTF)

    @cached_property
    def preview_surface(self) -> PrincipledFit:
        """The inputs of the Principled BSDF that are closest as a UsdPreviewSurface."""
        with single_threaded_blas():
            return fit_principled(self.material.brdf.evaluate, shown=PREVIEW_SURFACE)

    @cached_property
    def pictures(self) -> MeasuredPictures:
        """The images of an RGL measured material."""
        return pictures(self.material.brdf.evaluate)

    def error(self, evaluate: Evaluate) -> float:
        """Relative cube-root error of ``evaluate`` against the fitted BRDF."""
        return cube_root_error(evaluate, self.material.brdf.evaluate)

    @property
    def scale_note(self) -> tuple[str, ...]:
        """A note if the irradiance is unknown, otherwise empty."""
        if self.material.scale_known:
            return ()
        return (
            "the irradiance of the lights is unknown, so the absolute level of the BRDF is "
            f"arbitrary (it was multiplied by {self.material.scale:.4g})",
        )
