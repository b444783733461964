"""`run.py headless` and `run.py demo`: headless.py in whatever Blender is at hand."""

from __future__ import annotations

from collections.abc import Sequence

from .blender import find_blender, prepare, run_script
from .common import ROOT, call, say
from .environment import bpy_python

SCRIPT = ROOT / "headless.py"


def main(arguments: Sequence[str]) -> int:
    """Run one headless command and return its exit code."""
    if blender := find_blender():
        home = prepare(blender)
        say(f"using Blender {blender.label}")
        return run_script(blender, home, SCRIPT, arguments)
    return call([bpy_python(), SCRIPT, *arguments])


def demo(arguments: Sequence[str]) -> int:
    """Run the whole job on the embedded capture, into ./patina-demo unless told otherwise."""
    told = any(word.split("=")[0] == "--out" for word in arguments)
    return main(["demo", *([] if told else ["--out", "patina-demo"]), *arguments])
