"""How far an artist has moved the traits of a measured material, and the BRDF that results.

The measured coefficients on the material do not change (material_nodes.py); the sliders
hold what is added to them.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.appearance import trait_words
from ...core.appearance.osl_atlas import TRAITS, traits
from ...core.appearance.traits import (
    Looked,
    Movable,
    MovableAlbedo,
    beyond_measured,
    excess,
    moved,
)
from ...core.basis import Basis, PrincipalBRDF
from ...core.errors import PatinaError
from ...core.result.bases import basis_of_version
from ...core.views.sphere import LitSphere
from ..property_keys import BASIS_VERSION, COEFFICIENTS, MEASURED_NAME
from .preview import SMALL, Picture

QUICK = 128  # pixels across the sphere that follows a slider
CHANNELS = ("red", "green", "blue")
SLIDERS = tuple(
    f"trait_{i + 1}" for i in range(TRAITS)
)  # of each PatinaShifts (scene/material/trait_properties.py)


def movable(material: bpy.types.Material) -> bool:
    """True for a material that a fit made, in this file."""
    return MEASURED_NAME in material and COEFFICIENTS in material and material.library is None


def sliders(material: bpy.types.Material) -> tuple[str, ...]:
    """Those that the material has: no more than its fit has components."""
    return SLIDERS[: traits(len(material[COEFFICIENTS]) // 3)]


def shifts(material: bpy.types.Material) -> NDArray[np.float64]:
    """(3, sliders) of R, G and B: what all channels have in common and each one's own."""
    groups, names = material.patina_traits, sliders(material)
    every = np.array([getattr(groups.every, name) for name in names])
    own = [[getattr(getattr(groups, channel), name) for name in names] for channel in CHANNELS]
    return every + np.array(own)


def state(material: bpy.types.Material) -> str:
    """A short name of what the material is now: "" as measured."""
    amounts = shifts(material)
    if not amounts.any():
        return ""
    digest = hashlib.sha256(
        material[BASIS_VERSION].encode() + _stored(material) + amounts.tobytes()
    )
    return digest.hexdigest()[:12]


def measured_brdf(material: bpy.types.Material) -> PrincipalBRDF | None:
    """As measured; None where this computer lacks the basis it is in."""
    return _brdf(material[BASIS_VERSION], _stored(material))


def brdf_of(basis: str, coefficients: Sequence[float]) -> PrincipalBRDF | None:
    """Of coefficients (3 · k,), R, then G, then B, in the basis of that version; None where this
    computer lacks it."""
    return _brdf(basis, np.array(coefficients, np.float64).tobytes())


def moved_brdf(material: bpy.types.Material) -> PrincipalBRDF | None:
    """As the sliders have it, measured where they are at 0."""
    brdf = measured_brdf(material)
    return None if brdf is None else moved(brdf, shifts(material))


def quick_spheres(material: bpy.types.Material) -> list[Picture]:
    """The sphere and its icon as the sliders have it, soon; the basis must be here."""
    quick, amounts = _quick(material[BASIS_VERSION], _stored(material)), shifts(material)
    return [
        sphere.picture([part.at(amounts) for part in parts])
        for (sphere, _), parts in zip(_looked(material[BASIS_VERSION]), quick.spheres, strict=True)
    ]


@dataclass(frozen=True)
class Standing:
    """excess: (largest albedo, radians of its view) where it exceeds 1. beyond: components that lie
    where no material of the training set does."""

    excess: tuple[float, float] | None
    beyond: tuple[int, ...]


def standing(material: bpy.types.Material) -> Standing:
    """Whether the material is one that can be, as the sliders have it; the basis must be here."""
    return _standing(material[BASIS_VERSION], _stored(material), shifts(material).tobytes())


@lru_cache(maxsize=4)
def words_of(version: str) -> tuple[str, ...]:
    """What each slider does, of a basis of that version; () where this computer lacks it."""
    basis = _basis(version)
    return () if basis is None else tuple(trait_words.words(trait_words.effects(basis)))


def forget() -> None:
    """Let go of everything that was looked up."""
    for cache in (words_of, _basis, _brdf, _looked, _quick, _standing):
        cache.cache_clear()


def _stored(material: bpy.types.Material) -> bytes:
    return np.array(material[COEFFICIENTS], np.float64).tobytes()


@lru_cache(maxsize=4)  # panels ask at every redraw, also for what is not there
def _basis(version: str) -> Basis | None:
    try:
        return basis_of_version(version, Path("material"))
    except PatinaError:
        return None


@lru_cache(maxsize=8)
def _brdf(version: str, coefficients: bytes) -> PrincipalBRDF | None:
    basis = _basis(version)
    if basis is None:
        return None
    return PrincipalBRDF(basis, np.frombuffer(coefficients, np.float64).reshape(3, -1))


@dataclass(frozen=True)
class _Quick:
    """spheres: parts of the preview's sphere, and of the icon's."""

    spheres: tuple[tuple[Movable, ...], ...]
    albedo: MovableAlbedo


@lru_cache(maxsize=2)
def _looked(version: str) -> tuple[tuple[LitSphere, tuple[Looked, ...]], ...]:
    basis = _basis(version)
    both = (LitSphere.of(QUICK), LitSphere.of(SMALL))
    return tuple((s, tuple(Looked.of(basis, part.angles) for part in s.parts)) for s in both)


@lru_cache(maxsize=4)
def _quick(version: str, coefficients: bytes) -> _Quick:
    brdf = _brdf(version, coefficients)
    spheres = tuple(tuple(Movable.of(brdf, p) for p in parts) for _, parts in _looked(version))
    return _Quick(spheres, MovableAlbedo.of(brdf))


@lru_cache(maxsize=64)
def _standing(version: str, coefficients: bytes, amounts: bytes) -> Standing:
    there = np.frombuffer(amounts, np.float64).reshape(3, -1)
    albedo = _quick(version, coefficients).albedo.at(there)
    beyond = beyond_measured(_brdf(version, coefficients), there)
    return Standing(excess(albedo), tuple(beyond))
