"""Import the checkout as package `patina`; fixtures for the checkout and the reference data."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path

import pytest
from hypothesis import settings

# Tests that call functions outside a job, which would limit BLAS itself: its threads wait for one
# another in a loop, and take the cores from other tests. Set before NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tools.package import load_patina

load_patina()

# The same examples in every run of a commit; --hypothesis-profile=random looks for new ones.
settings.register_profile("fixed", derandomize=True, database=None)
settings.register_profile("random", derandomize=False)
settings.load_profile("fixed")

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def root() -> Path:
    """The folder of the checkout."""
    return ROOT


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of reference data (../shared); tests that need it are skipped without it."""
    folder = Path(os.environ.get("PATINA_SHARED", ROOT.parent / "shared"))
    if not (folder / "data").is_dir():
        pytest.skip("no reference data (../shared, or PATINA_SHARED)")
    return folder


@pytest.fixture
def simple_portable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simple fits for other renderers, in a fifth of the time, for tests that do not judge them."""
    from patina.core.appearance.cube_root import COARSE
    from patina.core.jobs import portable_materials as portable

    principled = partial(portable.fit_principled, coat=False, nodes=COARSE)
    monkeypatch.setattr(portable, "fit_principled", principled)
    monkeypatch.setattr(portable, "fit_lobe_stack", partial(portable.fit_lobe_stack, most=1))
