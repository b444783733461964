"""What pyproject.toml cannot say of the Python package: its version, and which files belong to it.

The repository root is the extension of Blender and the package ``patina`` at once. The version is
that of blender_manifest.toml; what only Blender or developers use is left out of the package.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).resolve().parent
ROOT_MODULES = ("__init__", "api")  # of the root's files: the others are scripts
NEEDS_BLENDER = {("patina.commands", "export_open")}


class BuildPackage(build_py):
    """Leaves out the scripts of the root and the modules that import bpy."""

    def find_package_modules(self, package: str, package_dir: str) -> list[tuple[str, str, str]]:
        """(package, module, file) of every module that is installed."""
        found = super().find_package_modules(package, package_dir)
        return [
            (owner, module, file)
            for owner, module, file in found
            if (owner, module) not in NEEDS_BLENDER
            and (owner != "patina" or module in ROOT_MODULES)
        ]


manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text("utf-8"))
inner = find_packages(str(ROOT), include=["core", "core.*", "commands"])
setup(
    version=manifest["version"],
    packages=["patina", *(f"patina.{name}" for name in inner)],
    package_dir={"patina": "."},
    package_data={
        "patina": ["blender_manifest.toml", "py.typed", "assets/**/*"],
    },
    cmdclass={"build_py": BuildPackage},
)
