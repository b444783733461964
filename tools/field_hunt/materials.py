"""Materials that are in no basis: the 25 validation materials (reference.md, section 4)."""

from __future__ import annotations

from functools import lru_cache

from patina.core.brdf import nbrdf

from ..experiments.materials import data_folder, materials
from .renderer import Evaluate


@lru_cache(maxsize=1)
def names() -> tuple[str, ...]:
    """Their names."""
    return tuple(nbrdf.load(data_folder() / "brdf" / "nbrdf_validation.npz")[0])


def all_materials() -> dict[str, Evaluate]:
    """Name → BRDF."""
    return {one.name: one.evaluate for one in materials(names())}
