"""A material on its way out: what several formats need of it, computed once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ..appearance.lobe_fit import LobeStackFit, fit_lobe_stack
from ..brdf import TabulatedBRDF
from ..result import FittedMaterial
from .file_names import identifier
from .losses import Evaluate, cube_root_error
from .measured_bsdf import MeasuredPictures, pictures


@dataclass(frozen=True)
class Subject:
    """A fitted material with its derived forms, made when they are first asked for."""

    material: FittedMaterial

    @property
    def name(self) -> str:
        """As the capture has it."""
        return self.material.name

    @property
    def id(self) -> str:
        """As files and formats have it."""
        return identifier(self.material.name)

    @cached_property
    def table(self) -> TabulatedBRDF:
        """At the MERL cells' centres."""
        return self.material.brdf.table()

    @cached_property
    def lobes(self) -> LobeStackFit:
        """The nearest stacks of lobes."""
        return fit_lobe_stack(self.material.brdf.evaluate)

    @cached_property
    def pictures(self) -> MeasuredPictures:
        """As an RGL measured material."""
        return pictures(self.material.brdf.evaluate)

    def error(self, evaluate: Evaluate) -> float:
        """Relative cube-root error of ``evaluate`` against the fitted BRDF."""
        return cube_root_error(evaluate, self.material.brdf.evaluate)

    @property
    def scale_note(self) -> tuple[str, ...]:
        """Where the irradiance was not known."""
        if self.material.scale_known:
            return ()
        return (
            "the light's strength was not known: the BRDF is right up to one factor "
            f"(it was multiplied by {self.material.scale:.4g})",
        )
