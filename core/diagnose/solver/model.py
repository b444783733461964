"""The forward model with effects: from coefficients and parameters to predicted photos."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..effects.base.effect import Effect
from ..effects.base.image_formation import (
    AddsRadiance,
    ChangesRecording,
    ChangesShading,
    ExtendsLamp,
)
from ..effects.base.patch_effect import PatchEffect
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.pixel_footprint import CORNERS, Footprint, at_corner
from ..forward.pixels import Pixels
from ..forward.shading_state import ShadingState

Array = NDArray[np.floating]
Vector = NDArray[np.float64]


@dataclass(frozen=True)
class LampLight:
    """state: surface and light with all effects. reflected: (n, 3) reflected radiance of the lamp.
    log_derivative: (n, 3) its derivative with respect to ln(ρ·cosMap + ε)."""

    state: ShadingState
    reflected: Array
    log_derivative: Array


@dataclass(frozen=True)
class Model:
    """effects: in the order in which they act; x: the parameters of each. frozen: places of effects
    whose parameters are known: they act, but nothing is fitted to them. footprint: of the same
    pixels, handed from model to model."""

    pixels: Pixels
    brdfs: MaterialBRDFs
    effects: tuple[Effect, ...] = ()
    x: tuple[Vector, ...] = ()
    frozen: frozenset[int] = frozenset()
    footprint: Footprint | None = None

    def __post_init__(self) -> None:
        if self.footprint is None:
            object.__setattr__(self, "footprint", Footprint(self.pixels))

    def with_effect(self, effect: Effect, x: Vector | None = None) -> Model:
        """One more effect, after the others. x: its parameters; None: where the search starts. Only
        one patch effect is fitted at a time: an earlier one is frozen as it was found."""
        before = self.with_patches_frozen() if isinstance(effect, PatchEffect) else self
        return replace(
            before,
            effects=(*before.effects, effect),
            x=(*before.x, effect.parameters.initial if x is None else x),
        )

    def without_effect(self, cause: str) -> Model:
        """The model without one of its effects."""
        place = self.place_of(cause)
        kept = [k for k in range(len(self.effects)) if k != place]
        effects, x = tuple(self.effects[k] for k in kept), tuple(self.x[k] for k in kept)
        frozen = frozenset(kept.index(k) for k in self.frozen if k != place)
        return replace(self, effects=effects, x=x, frozen=frozen)

    def with_patches_frozen(self) -> Model:
        """The parameters of patches are no longer fitted."""
        place = self.patch_place
        return self if place is None else replace(self, frozen=self.frozen | {place})

    @property
    def causes(self) -> list[str]:
        """Causes of all effects, frozen ones included."""
        return [effect.cause for effect in self.effects]

    def place_of(self, cause: str) -> int:
        """Place of an effect in the model."""
        return self.causes.index(cause)

    def is_frozen(self, cause: str) -> bool:
        """Whether an effect's parameters are no longer fitted."""
        return self.place_of(cause) in self.frozen

    def parameters_of(self, cause: str) -> Vector:
        """(p,) of an effect."""
        return self.x[self.place_of(cause)]

    def predicted_without(self, cause: str) -> Array:
        """(n, 3) prediction without one of the effects, the BRDFs unchanged: refitted, they would
        absorb much of it, as they absorb the light that glare takes from bright areas."""
        place, values = self.place_of(cause), list(self.x)
        values[place] = values[place] - self.effects[place].identified(values[place])
        return replace(self, x=tuple(values)).predicted()

    @property
    def global_places(self) -> list[int]:
        """Places of the fitted effects that have few parameters."""
        return [
            k
            for k, effect in enumerate(self.effects)
            if k not in self.frozen and not isinstance(effect, PatchEffect)
        ]

    @property
    def patch_place(self) -> int | None:
        """Place of the fitted effect that has parameters for many patches; None: there is none."""
        return next(
            (
                k
                for k, effect in enumerate(self.effects)
                if k not in self.frozen and isinstance(effect, PatchEffect)
            ),
            None,
        )

    @property
    def patch_effect(self) -> PatchEffect | None:
        """The fitted effect that has parameters for many patches."""
        effect = None if self.patch_place is None else self.effects[self.patch_place]
        return effect if isinstance(effect, PatchEffect) else None

    def parameter_index(self, place: int) -> NDArray[np.intp]:
        """(n, s) indices of an effect's parameters that each pixel depends on, −1 none: one a
        slot."""
        index = self.effects[place].parameter_index
        everything = np.arange(len(self.effects[place].parameters))
        return (
            np.broadcast_to(everything, (len(self.pixels), len(everything)))
            if index is None
            else index
        )

    def shading(self, x: Sequence[Vector] | None = None) -> ShadingState:
        """Surface and light with all effects, for a lamp that is a point."""
        state = ShadingState.of(self.pixels)
        for effect, values in zip(self.effects, self.x if x is None else x, strict=True):
            if isinstance(effect, ChangesShading):
                state = effect.shading(state, values)
        return state

    def lamp_parts(
        self, state: ShadingState, x: Sequence[Vector] | None = None
    ) -> list[ShadingState]:
        """One shading state for each of the equally bright parts of the lamp, where an effect gives
        it a size; each part then falls on another corner of the pixel."""
        parts = [state]
        for effect, values in zip(self.effects, self.x if x is None else x, strict=True):
            if isinstance(effect, ExtendsLamp):
                parts = [lamp for part in parts for lamp in effect.lamp_parts(part, values)]
        if len(parts) == 1:
            return parts
        return [at_corner(part, k % len(CORNERS)) for k, part in enumerate(parts)]

    def basis_rows(self, state: ShadingState) -> Array:
        """Q̂ (n, k): ∂ρ/∂c = (ρ + ε / cosMap) Q̂."""
        if state.differs_from_capture:
            return self.brdfs.rows(state.angles)
        assert self.footprint is not None
        return self.footprint.capture_rows(self.brdfs, state)

    def mean(self, parts: Sequence[ShadingState], of: Callable[[ShadingState], Array]) -> Array:
        """(n, d) means of ``of`` over the parts of the lamp and the footprint of the pixel."""
        if len(parts) > 1:
            return np.asarray(sum(of(part) for part in parts) / len(parts))
        assert self.footprint is not None
        out = of(parts[0])
        out[self.footprint.wide] = self.footprint.mean(parts[0], of)
        return out

    def reflected(self, parts: Sequence[ShadingState]) -> Array:
        """(n, 3) reflected radiance of the lamp."""
        return self.mean(parts, self.brdfs.reflected)

    @cached_property
    def lamp_light(self) -> LampLight:
        """The light of the lamp at the model's own parameters."""
        state = self.shading()
        both = self.mean(self.lamp_parts(state), self.brdfs.reflected_with_derivative)
        return LampLight(state, both[:, :3], both[:, 3:])

    def entering(
        self, reflected: Array, state: ShadingState, x: Sequence[Vector] | None = None
    ) -> Array:
        """(n, 3) radiance that reaches the camera. All that is added to the light of the lamp is
        reflected by the surface too."""
        total = reflected
        for effect, values in zip(self.effects, self.x if x is None else x, strict=True):
            if isinstance(effect, AddsRadiance):
                added = effect.added_radiance(state, self.brdfs, values)
                total = total + (added if state.albedo is None else added * state.albedo)
        return total

    def recorded(
        self, radiance: Array, state: ShadingState, x: Sequence[Vector] | None = None
    ) -> Array:
        """(n, 3) recorded radiance. radiance: (n, 3) that reaches the camera."""
        for effect, values in zip(self.effects, self.x if x is None else x, strict=True):
            if isinstance(effect, ChangesRecording):
                radiance = effect.recorded(radiance, state, values)
        return radiance

    def predicted(self, x: Sequence[Vector] | None = None) -> Array:
        """(n, 3) predicted radiance in the photos. x: parameters in place of the model's own."""
        if x is None:
            return self.photographed(self.lamp_light.state, self.lamp_light.reflected)
        state = self.shading(x)
        return self.photographed(state, self.reflected(self.lamp_parts(state, x)), x)

    def photographed(
        self, state: ShadingState, reflected: Array, x: Sequence[Vector] | None = None
    ) -> Array:
        """(n, 3) predicted radiance in the photos. reflected: (n, 3) reflected radiance of the
        lamp."""
        return self.recorded(self.entering(reflected, state, x), state, x)
