"""Run modules of this folder in the test environment, which has all libraries and trimesh."""

from __future__ import annotations

import os
from collections.abc import Sequence

from .common import ROOT, call
from .environment import test_python


def main(module: str, arguments: Sequence[str]) -> int:
    """Run `python -m MODULE ...` in the test environment and return its exit code."""
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    return call([test_python(), "-m", module, *arguments], env=env)
