"""The checkout as package `patina`, and the data beside it where there is any."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tools.package import load_patina

load_patina()

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout."""
    return ROOT


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of reference data beside the checkout; tests that want it skip without it."""
    folder = Path(os.environ.get("PATINA_SHARED", ROOT.parent / "shared"))
    if not (folder / "data").is_dir():
        pytest.skip("the reference data is not here (../shared, or PATINA_SHARED)")
    return folder
