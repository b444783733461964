"""The embedded basis, computed from the neural encodings of the 100 MERL materials."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import ClassVar

from .basis import Basis
from .storage import load

DEFAULT_FILE = Path(__file__).parents[2] / "assets" / "basis" / "nbrdf_basis.npz"


class EmbeddedBasis(Basis):
    """The embedded basis. Another process loads its own."""

    STORED_APART: ClassVar[bool] = False

    def __reduce__(self) -> tuple[Callable[[], Basis], tuple[()]]:
        return default_basis, ()


@lru_cache(maxsize=1)
def default_basis() -> Basis:
    """The embedded basis, loaded once; needs no network and no file of the user."""
    found = load(DEFAULT_FILE)
    return EmbeddedBasis(**vars(found))
