"""The materials, their true BRDFs from neural encodings, and bases that do not contain them."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from patina.core.angles import Angles
from patina.core.basis.build_default import PROVENANCE, NeuralObservations
from patina.core.basis.merl_folder import user_cache
from patina.core.basis.training_set import FORMAT, TrainedBasis, TrainingSet
from patina.core.brdf import nbrdf
from patina.core.errors import InputError

from ..common import ROOT, say

PAPER = (
    "alum-bronze",
    "fruitwood-241",
    "pink-fabric",
    "blue-acrylic",
    "pink-fabric2",
    "green-latex",
)
"""The six materials of Ono et al. 2019, in the order of their Fig. 9."""

FLAT = frozenset(
    (
        "pink-fabric", "pink-fabric2", "green-latex", "acrylic_felt_pink_rgb", "paper_blue_rgb",
        "paper_white_rgb", "greencloth",
    )
)  # fmt: skip
"""Fabric, latex, felt and paper: materials almost without a highlight."""


@dataclass(frozen=True)
class Material:
    """One material. weights: (675,) of its encoding; trained: whether it is in MERL."""

    name: str
    weights: NDArray[np.float32]
    trained: bool

    def evaluate(self, angles: Angles) -> NDArray[np.float32]:
        """Return the true ρ (..., 3) in 1/sr, computed by the network."""
        return nbrdf.evaluate(self.weights, angles)


def data_folder() -> Path:
    """Return the folder of the reference data, by default in ../shared."""
    return Path(os.environ.get("PATINA_SHARED", ROOT.parent / "shared")) / "data"


def materials(names: Sequence[str] | None = None) -> list[Material]:
    """Return the named materials; by default the paper's six and the 25 validation materials."""
    merl = _encodings("nbrdf_merl.npz")
    validation = _encodings("nbrdf_validation.npz")
    if names is None:
        names = [*PAPER, *validation]
    return [
        Material(name, merl[name], True)
        if name in merl
        else Material(name, validation[name], False)
        for name in names
    ]


FOLDS = 5
"""The validation materials are divided by name into so many parts: the prior for a material of one
part is learnt from MERL and the other parts."""


def training_set() -> TrainingSet:
    """Return the columns of all 125 encodings, computed once (30 s) and then cached."""
    return _training_set()


def fold_of(name: str) -> int:
    """Return the part of the validation materials that a material is in. Materials of one kind,
    such as three finishes of one flaked paint, are in the same part."""
    kinds = sorted({_kind(each) for each in _encodings("nbrdf_validation.npz")})
    return kinds.index(_kind(name)) % FOLDS


def basis_for(
    material: Material, count: int = 40, in_basis: bool = False, merl_prior: bool = False
) -> TrainedBasis:
    """Return the basis without the material. Its prior is learnt from MERL and the validation
    materials, without the material and all that are in the same part (``fold_of``).

    in_basis: return the basis of all 100 materials of MERL, which includes the paper's six.
    merl_prior: learn the prior from MERL alone.
    """
    validation = validation_names()
    if merl_prior:
        own = (material.name,) if material.trained and not in_basis else ()
        return _basis((*validation, *own), count)
    if not material.trained:
        part = fold_of(material.name)
        return _basis(tuple(n for n in validation if fold_of(n) == part), count)
    return _basis(() if in_basis else (material.name,), count)


def full_basis(count: int = 40, merl_prior: bool = False) -> TrainedBasis:
    """Return the basis of all 100 materials of MERL; its prior is learnt from these and the
    validation materials, or with merl_prior from MERL alone."""
    return _basis(validation_names() if merl_prior else (), count)


def validation_names() -> tuple[str, ...]:
    """Return the names of the 25 materials that are not in MERL."""
    return tuple(_encodings("nbrdf_validation.npz"))


def _kind(name: str) -> str:
    """The first word of a name: the series of a manufacturer, or the kind of material."""
    return name.split("_")[0]


@lru_cache(maxsize=1)
def _training_set() -> TrainingSet:
    files = [data_folder() / "brdf" / f"nbrdf_{part}.npz" for part in ("merl", "validation")]
    content = b"".join(file.read_bytes() for file in files)
    key = hashlib.sha256(content + bytes([FORMAT])).hexdigest()[:16]
    stored = user_cache() / f"training_set_{key}.npz"
    if stored.is_file():
        try:
            return TrainingSet.load(stored)
        except InputError:
            stored.unlink()  # a damaged cache file is computed again
    say("computing the training columns (30 s, once)")
    each = [nbrdf.load(file) for file in files]
    names = [name for part, _ in each for name in part]
    weights = np.concatenate([values for _, values in each])
    found = TrainingSet.compute(NeuralObservations(weights), names, PROVENANCE)
    stored.parent.mkdir(parents=True, exist_ok=True)
    found.save(stored)
    return found


@lru_cache(maxsize=5)
def _basis(without: tuple[str, ...], count: int) -> TrainedBasis:
    others = [name for name in _encodings("nbrdf_validation.npz") if name not in without]
    return training_set().basis(without, count, others)


@lru_cache(maxsize=2)
def _encodings(file: str) -> dict[str, NDArray[np.float32]]:
    names, weights = nbrdf.load(data_folder() / "brdf" / file)
    return dict(zip(names, weights, strict=True))
