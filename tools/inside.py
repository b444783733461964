"""Programs of this folder that need the libraries: run with the Python that has them."""

from __future__ import annotations

import os
from collections.abc import Sequence

from .common import ROOT, call
from .environment import bpy_python


def main(module: str, arguments: Sequence[str]) -> int:
    """Run `python -m MODULE ...` in our environment and return its exit code."""
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    return call([bpy_python(), "-m", module, *arguments], env=env)
