"""The embedded basis, computed from the neural encodings of the 100 MERL materials."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from .basis import Basis
from .storage import load

DEFAULT_FILE = Path(__file__).parents[2] / "assets" / "basis" / "nbrdf_basis.npz"


@lru_cache(maxsize=1)
def default_basis() -> Basis:
    """The embedded basis, loaded once; needs no network and no file of the user."""
    return load(DEFAULT_FILE)
