"""The command that runs a module of Patina in a Python of its own, without Blender."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from ..errors import PatinaError

ROOT = Path(__file__).resolve().parents[2]
"""The folder of the package."""
CODE = "import importlib, sys; sys.exit(importlib.import_module(sys.argv[1]).main(sys.argv[2:]))"


def python_command(module: str, *words: str) -> list[str]:
    """The words of the command. module: within the package, with a function
    ``main(words) -> exit code``. Raises PatinaError where this Blender has no Python program."""
    return [str(_python()), "-s", "-P", "-c", CODE, f"{ROOT.name}.{module}", *words]


def python_environment() -> dict[str, str]:
    """The environment in which that Python imports what this process imports."""
    own = [folder for folder in sys.path if folder and not _is_blenders(Path(folder))]
    folders = [str(ROOT.parent), *own]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(folders), "PYTHONSAFEPATH": "1"}


def _is_blenders(folder: Path) -> bool:
    """Whether a folder holds Blender's scripts, whose module bpy only works within Blender."""
    return (folder / "addon_utils.py").is_file()


def _python() -> Path:
    """The Python of this process. In Blender it is the one that Blender brings along."""
    own = Path(sys.executable)
    if own.stem.lower().startswith("python") and own.is_file():
        return own
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    for name in (f"bin/python{version}", "bin/python3", "bin/python.exe", "python.exe"):
        found = Path(sys.prefix) / name
        if found.is_file():
            return found
    raise PatinaError(
        f"No Python program was found for Blender's own Python {version} in {sys.prefix}; expected "
        "bin/python there. Install Blender from its official archive"
    )
