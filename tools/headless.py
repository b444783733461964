"""`run.py headless` and `run.py demo`: run headless.py in Blender, or with the bpy wheel."""

from __future__ import annotations

from collections.abc import Sequence

from . import viewer_program
from .blender import find_blender, prepare, run_script
from .common import ROOT, call, say
from .environment import bpy_python
from .repair import remove_if_damaged

SCRIPT = ROOT / "headless.py"


def main(arguments: Sequence[str]) -> int:
    """Run one headless command and return its exit code."""
    viewer_program.build_if_possible()
    if blender := find_blender():
        home = prepare(blender)
        say(f"using Blender {blender.label}")
        return run_script(blender, home, SCRIPT, arguments)
    python = bpy_python()
    code = call([python, SCRIPT, *arguments])
    remove_if_damaged(python, code)
    return code


def demo(arguments: Sequence[str]) -> int:
    """Run the command `demo`; write to ./patina-demo unless --out is given."""
    has_out = any(word.split("=")[0] == "--out" for word in arguments)
    return main(["demo", *([] if has_out else ["--out", "patina-demo"]), *arguments])
