#!/usr/bin/env python3
"""Run Patina from a terminal: `python3 run.py demo`, `headless`, `test` or `build`.

Requires only Python >= 3.11. Missing dependencies are installed on the first call, into a cache
folder of the user.
"""

from __future__ import annotations

import importlib.util
import sys

USAGE = "usage: python3 run.py COMMAND ...  (COMMAND --help lists the options)"

COMMANDS = {
    "demo": ("tools.headless:demo", "run the demo capture and write the results to ./patina-demo"),
    "headless": ("tools.headless:main", "run a headless command: fit, import, compare, basis ..."),
    "test": ("tools.checks:main", "run ruff, mypy and pytest; with --blender also in Blender"),
    "build": ("tools.build:main", "build the zips of the extension, one per platform, in dist/"),
    "pictures": ("tools.make_pictures", "render the pictures of docs/images again"),
    "experiments": ("tools.experiments", "run the experiments of docs/method/experiments.md"),
    "hunt": ("tools.hunt.table", "diagnose simulated captures with a hidden effect"),
    "torture": ("tools.faults.kills", "kill commands at random, and check that no result is lost"),
    "faults": ("tools.faults.conditions", "run commands on a full disk, in a read-only folder ..."),
    "fuzz": ("tools.fuzz", "give changed files to the readers, and look for faults"),
    "bench": ("tools.bench_main", "run the benchmarks behind the figures in docs/"),
}
"""Command → (entry point, help text). A MODULE:FUNCTION is called in this process with the
arguments; a MODULE alone is run in the test environment. Commands whose module is absent are not
offered."""


def available() -> dict[str, tuple[str, str]]:
    """Return the commands whose module exists."""
    return {
        name: entry
        for name, entry in COMMANDS.items()
        if importlib.util.find_spec(entry[0].partition(":")[0])
    }


def main(words: list[str]) -> int:
    """Run one command and return its exit code; a Failure is printed as one line."""
    if sys.version_info < (3, 11):  # noqa: UP036  message for users of an older Python
        print("patina: run.py needs Python 3.11 or later", file=sys.stderr)
        return 2
    from tools.common import Failure

    commands = available()
    if not words or words[0] not in commands:
        help_requested = words[:1] in (["-h"], ["--help"])
        out = sys.stdout if help_requested else sys.stderr
        print(USAGE, file=out)
        for name, (_, what) in commands.items():
            print(f"  {name:10} {what}", file=out)
        return 0 if help_requested else 2
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
        print("patina: Interrupted.", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
