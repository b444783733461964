"""``fit`` without scene.blend and report, and with simple fits for other renderers: these take most
of the time of a small capture. For batches of hundreds of captures.

python tools/faults/quick_fit.py fit CAPTURE --out DIR [OPTION ...]
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tools.package import load_patina


def main(words: list[str]) -> int:
    """Run the command; returns its exit code."""
    load_patina()
    from patina.commands import command_line, fit
    from patina.core.jobs import portable_materials as portable

    fit.has_blender = lambda: False
    fit.write_report = lambda folder, result: iter(())
    portable.fit_principled = partial(portable.fit_principled, coat=False)
    portable.fit_lobe_stack = partial(portable.fit_lobe_stack, most=1)
    return command_line.main(words)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
