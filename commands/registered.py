"""The command line in a Python that has Blender as the module bpy."""

from __future__ import annotations

import importlib
from collections.abc import Sequence

from .command_line import main as run_command


def main(words: Sequence[str]) -> int:
    """Register Patina in Blender, then run one command; returns its exit code."""
    importlib.import_module(__package__.rpartition(".")[0]).register()
    return run_command(words)
