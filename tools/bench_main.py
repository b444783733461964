"""`run.py bench [NAME ...]`: repeat the measurements of docs/method/measurements.md."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from pathlib import Path

from .common import ROOT
from .package import load_patina

BENCHES = (
    "basis",
    "sampling",
    "fit",
    "light",
    "find_light",
    "real",
    "varying",
    "large",
    "objects",
    "renders",
    "solve",
    "noise",
    "viewport",
    "diagnose",
    "speed",
    "traits",
    "steps",
    "batch",
)
WITHOUT_DATA = ("renders", "large", "speed", "traits", "steps", "batch")  # need no reference data


def main() -> int:
    """Run the named benchmarks, or all; return the exit code."""
    parser = argparse.ArgumentParser(prog="run.py bench", description=__doc__)
    parser.add_argument(
        "names",
        nargs="*",
        metavar="NAME",
        help=f"benchmarks to run: {', '.join(BENCHES)} (default: all)",
    )
    arguments = parser.parse_args()
    unknown = [name for name in arguments.names if name not in BENCHES]
    if unknown:
        parser.error(f"found {unknown[0]!r}, expected one of {', '.join(BENCHES)}")
    if arguments.names and set(arguments.names) <= set(WITHOUT_DATA):
        load_patina()
        for name in arguments.names:
            importlib.import_module(f".bench_{name}", __package__).run(Path())
        return 0
    data = Path(os.environ.get("PATINA_SHARED", ROOT.parent / "shared")) / "data"
    if not data.is_dir():
        print(
            f"bench: found no reference data; expected it in ../shared/{data.name}", file=sys.stderr
        )
        return 2
    load_patina()
    for name in arguments.names or BENCHES:
        importlib.import_module(f".bench_{name}", __package__).run(data)
    return 0


if __name__ == "__main__":
    sys.exit(main())
