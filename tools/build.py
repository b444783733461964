"""`run.py build`: build the zips of the extension."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from . import manual, viewer_program
from .blender import find_blender
from .common import ROOT, Failure, megabytes, say
from .environment import bpy_python
from .extension import ExtensionTool, pack
from .wheels import PLATFORMS, PYTHONS

DIST = ROOT / "dist"


def extension_tool() -> ExtensionTool:
    """Return the extension tool of an installed Blender, or its copy in the bpy wheel."""
    if blender := find_blender():
        return blender.extension_tool
    python = bpy_python()
    scripts = "**/site-packages/bpy/*/scripts"
    for folder in python.parent.parent.glob(scripts):
        script = folder / "addons_core/bl_pkg/cli/blender_ext.py"
        tags = folder / "modules/_bpy_internal/extensions/tags.py"
        if script.exists() and tags.exists():
            return ExtensionTool((str(python), str(script)), tags)
    raise Failure("found no extension tool in the bpy wheel", 1)


def main(arguments: Sequence[str]) -> int:
    """`run.py build`: build the zips of all or of the given platforms."""
    parser = argparse.ArgumentParser(prog="run.py build", description=__doc__)
    parser.add_argument(
        "--platform",
        choices=PLATFORMS,
        action="append",
        help="platform to build for; can be repeated (default: all)",
    )
    parser.add_argument(
        "--raw", action="store_true", help="include camera RAW support (rawpy); write to dist/raw"
    )
    options = parser.parse_args(arguments)
    viewer_program.build()  # a zip without the viewer or the manual must not be published
    manual.build()
    platforms, out = options.platform or PLATFORMS, DIST / "raw" if options.raw else DIST
    for archive in pack(extension_tool(), platforms, PYTHONS, out, options.raw):
        say(f"{archive.name}: {megabytes([archive])}, validated")
        print(archive)
    return 0
