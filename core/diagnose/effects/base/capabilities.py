"""Requirements of effects, and the measures by which they are judged."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from ...forward.diagnosis_context import DiagnosisContext
from .effect import Array, Effect, Vector


class TracesRays(Effect, ABC):
    """Moves the lamp or a photo, so that visibility has to be traced again.

    Rays are expensive: this is done once the effect is accepted.
    """

    @abstractmethod
    def with_rays(self, context: DiagnosisContext, x: Vector) -> Effect:
        """The effect with visibility traced anew for the parameters x."""

    def ray_parameters(
        self, context: DiagnosisContext, x: Vector, predict: Callable[[Effect, Vector], Array]
    ) -> Vector:
        """(p,) parameters for which rays should be traced. x: (p,) the optimum that derivatives led
        to, which may be a local one. predict: (n, 3) the prediction of the model with another
        version of this effect and its parameters, the BRDFs unchanged."""
        return x


class DisplacesLamp(TracesRays, ABC):
    """Moves the lamp, and its shadows with it."""


class BuiltFromBRDFs(Effect, ABC):
    """Sums over the fitted BRDFs, and is built again when they are known better."""

    def rebuilt(self, context: DiagnosisContext, x: Vector) -> Effect:
        """The effect for the BRDFs of ``context``. x: (p,) its parameters as found with others."""
        effect = type(self).of(context)
        assert effect is not None
        return effect


class NeedsPhoto(Effect, ABC):
    """Needs the neighbourhood of a pixel in the photo: its gradient and its wide blur."""


class WidensHighlights(Effect, ABC):
    """Makes highlights wider than the material does."""


class AffectsHighlightsOnly(Effect, ABC):
    """Changes nothing but highlights: the change it makes is measured up to their peak."""


class JudgedByPixel(Effect, ABC):
    """Confined to few regions of the photos: held-out pixels judge it, not held-out regions."""
