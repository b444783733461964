"""The interface of an effect: one way in which the forward model may be wrong.

Every effect is an ``Effect``. It also derives from classes of image_formation.py (where in the
formation of a photo it acts) and of capabilities.py (what it needs or how it is judged). An effect
that derives from none of these changes nothing.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...forward.diagnosis_context import DiagnosisContext, NearestPixels
from .parameters import Parameters

Array = NDArray[np.floating]
Vector = NDArray[np.float64]


class Effect(ABC):
    """One cause of the vocabulary, built for the pixels that it is to explain.

    cause: its word in the vocabulary. deciding_photo: the photo that would distinguish it
    from other causes.
    systematic_error: relative error of the effect's own numerical sums.
    """

    cause: str
    deciding_photo: str
    systematic_error = 0.0

    @classmethod
    @abstractmethod
    def of(cls, context: DiagnosisContext) -> Effect | None:
        """The effect for a capture; None where it cannot occur."""

    @property
    @abstractmethod
    def parameters(self) -> Parameters:
        """The unknowns."""

    @abstractmethod
    def sentence(self, x: Vector, error: Vector) -> str:
        """Description for the user: one or two complete sentences. x: (p,) parameters; error: (p,)
        their standard errors."""

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> Effect | None:
        """The effect with the same parameters for other pixels, those of ``context``. nearest: of
        the pixels that it was built for. None where it changes nothing."""
        return type(self).of(context)

    @property
    def identifiable(self) -> Vector | None:
        """(p, p) projection onto the part of the parameters that the photos determine. The BRDF can
        absorb the rest: the mean of all photos' gains, for example. None: they determine all."""
        return None

    def identified(self, x: Vector) -> Vector:
        """(p,) the part of the parameters that the photos determine."""
        return x if self.identifiable is None else self.identifiable @ x

    def systematic_errors(self, x: Vector) -> Vector:
        """(p,) errors of the parameters x that the effect's own approximations cause."""
        return self.systematic_error * np.abs(x)

    @property
    def starts(self) -> Sequence[Effect]:
        """The effect with other starting values, where one does not reach all sizes of it."""
        return (self,)

    def initial(self, residual: Array, predicted: Array) -> Vector:
        """(p,) where the search starts. residual: (n, 3) photo minus prediction without the effect,
        0 where the prediction is dark. predicted: (n, 3). A robust fit treats a large residual as
        an outlier, so a start far from the optimum would never reach it."""
        return self.parameters.initial

    def is_relevant(self, x: Vector) -> bool:
        """Whether the effect is large enough to be reported."""
        return True

    @property
    def degrees_of_freedom(self) -> int:
        """How many independent things it can change."""
        return len(self.parameters)

    @property
    def parameter_index(self) -> NDArray[np.intp] | None:
        """(n, s) indices of the parameters that each pixel depends on, −1 none, one a slot; no
        pixel depends on two parameters of one slot. None: every pixel depends on all of them."""
        return None

    @property
    def combined_slots(self) -> Mapping[int, Mapping[int, Array]]:
        """Slot (column of parameter_index) → other slots with (n,) factors: its derivative is the
        sum of theirs times these, which saves a prediction."""
        return {}

    @property
    def slots_without_lamp_light(self) -> frozenset[int]:
        """Slots whose parameters do not change the reflected light of the lamp, though others
        do."""
        return frozenset()
