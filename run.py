#!/usr/bin/env python3
"""Patina from a terminal: `python3 run.py demo`, `headless`, `test` or `build`.

Needs any Python >= 3.11 and nothing else; what is missing is set up on the first call, in a cache
folder of the user's.
"""

from __future__ import annotations

import importlib.util
import sys

USAGE = "usage: python3 run.py COMMAND ...  (--help after a command says more)"

COMMANDS = {
    "demo": ("tools.headless:demo", "all of it on the embedded capture, into ./patina-demo"),
    "headless": ("tools.headless:main", "a headless command: fit, import, compare, basis ..."),
    "test": ("tools.checks:main", "ruff, mypy and pytest; with --blender also in Blender"),
    "build": ("tools.build:main", "the extension's zips, one per platform, into dist/"),
    "pictures": ("tools.make_pictures", "the pictures of docs/images, made anew"),
    "experiments": ("tools.experiments", "the paper's experiment, for docs/method/experiments.md"),
    "hunt": ("tools.hunt.table", "captures with a hidden effect, and whether it is found"),
    "bench": ("tools.bench_main", "the measurements behind the figures in docs/"),
}
"""Command → what runs and what it does: MODULE:FUNCTION is called here with the arguments, a
MODULE alone is run in the environment of the tests. No module, no command."""


def available() -> dict[str, tuple[str, str]]:
    """Return the commands whose module exists."""
    return {
        name: entry
        for name, entry in COMMANDS.items()
        if importlib.util.find_spec(entry[0].partition(":")[0])
    }


def main(words: list[str]) -> int:
    """Dispatch, and turn a Failure into its one line."""
    if sys.version_info < (3, 11):  # noqa: UP036  whoever has an older one reads this
        print("patina: run.py needs Python 3.11 or later", file=sys.stderr)
        return 2
    from tools.common import Failure

    commands = available()
    if not words or words[0] not in commands:
        asked_for_help = words[:1] in (["-h"], ["--help"])
        out = sys.stdout if asked_for_help else sys.stderr
        print(USAGE, file=out)
        for name, (_, what) in commands.items():
            print(f"  {name:10} {what}", file=out)
        return 0 if asked_for_help else 2
    module, _, function = commands[words[0]][0].partition(":")
    try:
        if function:
            return getattr(importlib.import_module(module), function)(words[1:])
        from tools import inside

        return inside.main(module, words[1:])
    except Failure as failure:
        print(f"patina: {failure}", file=sys.stderr)
        return failure.code
    except KeyboardInterrupt:
        print("patina: stopped", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
