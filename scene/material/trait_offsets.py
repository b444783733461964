"""Offsets that the user adds to the traits of a measured material, and the resulting BRDF.

The measured coefficients on the material do not change (material_nodes.py); the sliders hold the
offsets to them.
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
    ComponentLookup,
    ShiftableAlbedo,
    ShiftableBRDF,
    beyond_measured,
    excess,
    shifted,
)
from ...core.basis import Basis, PrincipalBRDF
from ...core.errors import PatinaError
from ...core.result.bases import basis_of_version
from ...core.views.prepared_materials import ICON_SIZE, Picture
from ...core.views.sphere import LitSphere
from ..property_keys import BASIS_VERSION, COEFFICIENTS, MEASURED_NAME

QUICK_SIZE = 128  # width of the preview that is drawn while a slider moves, pixels
CHANNELS = ("red", "green", "blue")
SLIDERS = tuple(
    f"trait_{i + 1}" for i in range(TRAITS)
)  # properties of PatinaShifts (scene/material/trait_properties.py)


def movable(material: bpy.types.Material) -> bool:
    """Whether the material was created by a fit and belongs to this file (not to a library)."""
    return MEASURED_NAME in material and COEFFICIENTS in material and material.library is None


def sliders(material: bpy.types.Material) -> tuple[str, ...]:
    """The sliders of a material: no more than its fit has components."""
    return SLIDERS[: traits(len(material[COEFFICIENTS]) // 3)]


def shifts(material: bpy.types.Material) -> NDArray[np.float64]:
    """(3, sliders) offsets of R, G and B: the common offset of all channels plus each one's own."""
    groups, names = material.patina_traits, sliders(material)
    every = np.array([getattr(groups.every, name) for name in names])
    own = [[getattr(getattr(groups, channel), name) for name in names] for channel in CHANNELS]
    return every + np.array(own)


def state(material: bpy.types.Material) -> str:
    """A short hash of the material's present traits; "" as measured."""
    amounts = shifts(material)
    if not amounts.any():
        return ""
    digest = hashlib.sha256(
        material[BASIS_VERSION].encode() + _stored(material) + amounts.tobytes()
    )
    return digest.hexdigest()[:12]


def measured_brdf(material: bpy.types.Material) -> PrincipalBRDF | None:
    """The BRDF as measured; None if its basis is not on this computer."""
    return _brdf(material[BASIS_VERSION], _stored(material))


def brdf_of(basis: str, coefficients: Sequence[float]) -> PrincipalBRDF | None:
    """The BRDF of coefficients (3 · k,), R, then G, then B, in the basis of that version; None if
    the basis is not on this computer."""
    return _brdf(basis, np.array(coefficients, np.float64).tobytes())


def edited_brdf(material: bpy.types.Material) -> PrincipalBRDF | None:
    """The BRDF with the offsets of the sliders; None if its basis is not on this computer."""
    brdf = measured_brdf(material)
    return None if brdf is None else shifted(brdf, shifts(material))


def quick_spheres(material: bpy.types.Material) -> list[Picture]:
    """Small spheres of preview and icon with the offsets of the sliders, computed quickly. The
    basis must be on this computer."""
    quick, amounts = _quick(material[BASIS_VERSION], _stored(material)), shifts(material)
    return [
        sphere.picture([part.at(amounts) for part in parts])
        for (sphere, _), parts in zip(_looked(material[BASIS_VERSION]), quick.spheres, strict=True)
    ]


@dataclass(frozen=True)
class Plausibility:
    """Plausibility of an edited material.

    excess: (largest albedo, its view angle in radians) if the albedo exceeds 1, else None. beyond:
    indices of the components outside the range of the training materials.
    """

    excess: tuple[float, float] | None
    beyond: tuple[int, ...]


def plausibility(material: bpy.types.Material) -> Plausibility:
    """Plausibility of the material with the offsets of the sliders. The basis must be on this
    computer."""
    return _plausibility(material[BASIS_VERSION], _stored(material), shifts(material).tobytes())


@lru_cache(maxsize=4)
def slider_labels(version: str) -> tuple[str, ...]:
    """The effect of each slider in words, for the basis of that version; () if the basis is not on
    this computer."""
    basis = _basis(version)
    return () if basis is None else tuple(trait_words.words(trait_words.effects(basis)))


def clear_caches() -> None:
    """Clear all caches."""
    for cache in (slider_labels, _basis, _brdf, _looked, _quick, _plausibility):
        cache.cache_clear()


def _stored(material: bpy.types.Material) -> bytes:
    return np.array(material[COEFFICIENTS], np.float64).tobytes()


@lru_cache(maxsize=4)  # panels look it up at every redraw, also if it does not exist
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
    """Precomputed values of one material. spheres: parts of the spheres of preview and icon."""

    spheres: tuple[tuple[ShiftableBRDF, ...], ...]
    albedo: ShiftableAlbedo


@lru_cache(maxsize=2)
def _looked(version: str) -> tuple[tuple[LitSphere, tuple[ComponentLookup, ...]], ...]:
    basis = _basis(version)
    both = (LitSphere.of(QUICK_SIZE), LitSphere.of(ICON_SIZE))
    return tuple(
        (s, tuple(ComponentLookup.of(basis, part.angles) for part in s.parts)) for s in both
    )


@lru_cache(maxsize=4)
def _quick(version: str, coefficients: bytes) -> _Quick:
    brdf = _brdf(version, coefficients)
    spheres = tuple(
        tuple(ShiftableBRDF.of(brdf, p) for p in parts) for _, parts in _looked(version)
    )
    return _Quick(spheres, ShiftableAlbedo.of(brdf))


@lru_cache(maxsize=64)
def _plausibility(version: str, coefficients: bytes, amounts: bytes) -> Plausibility:
    offsets = np.frombuffer(amounts, np.float64).reshape(3, -1)
    albedo = _quick(version, coefficients).albedo.at(offsets)
    beyond = beyond_measured(_brdf(version, coefficients), offsets)
    return Plausibility(excess(albedo), tuple(beyond))
