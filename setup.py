"""The parts of the package metadata that pyproject.toml cannot express: version and files.

The repository root is both the Blender extension and the package ``patina``. The version is that of
blender_manifest.toml. Modules that only Blender or developers use are not part of the package.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).resolve().parent
ROOT_MODULES = ("__init__", "api")  # the other files of the root are scripts


class BuildPackage(build_py):
    """Excludes the scripts of the root."""

    def find_package_modules(self, package: str, package_dir: str) -> list[tuple[str, str, str]]:
        """Return (package, module, file) of every module that is installed."""
        found = super().find_package_modules(package, package_dir)
        return [
            (owner, module, file)
            for owner, module, file in found
            if owner != "patina" or module in ROOT_MODULES
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
    exclude_package_data={"patina": ["assets/manual/**/*", "assets/manual.part/**/*"]},
    cmdclass={"build_py": BuildPackage},
)
