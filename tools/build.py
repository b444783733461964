"""`run.py build`: the zips that are given away."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from .blender import find_blender
from .common import ROOT, Failure, megabytes, say
from .environment import bpy_python
from .extension import ExtensionTool, pack
from .wheels import PLATFORMS, PYTHONS

DIST = ROOT / "dist"


def extension_tool() -> ExtensionTool:
    """Return the Blender at hand's tool, or the copy of it that lies in the bpy wheel."""
    if blender := find_blender():
        return blender.extension_tool
    python = bpy_python()
    scripts = "**/site-packages/bpy/*/scripts"
    for folder in python.parent.parent.glob(scripts):
        script = folder / "addons_core/bl_pkg/cli/blender_ext.py"
        tags = folder / "modules/_bpy_internal/extensions/tags.py"
        if script.exists() and tags.exists():
            return ExtensionTool((str(python), str(script)), tags)
    raise Failure("this bpy wheel has no extension tool", 1)


def main(arguments: Sequence[str]) -> int:
    """`run.py build`: every platform's zip, or one."""
    parser = argparse.ArgumentParser(prog="run.py build", description=__doc__)
    parser.add_argument("--platform", choices=PLATFORMS, action="append", help="default: all")
    parser.add_argument(
        "--raw", action="store_true", help="with camera RAW (rawpy); the zips go to dist/raw"
    )
    told = parser.parse_args(arguments)
    asked, out = told.platform or PLATFORMS, DIST / "raw" if told.raw else DIST
    for archive in pack(extension_tool(), asked, PYTHONS, out, told.raw):
        say(f"{archive.name}: {megabytes([archive])}, validated")
        print(archive)
    return 0
