"""`run.py bench [NAME ...]`: what docs/method/measurements.md states, measured again."""

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
    "real",
    "solve",
    "noise",
    "viewport",
    "diagnose",
    "speed",
    "traits",
    "steps",
)
OWN = ("speed", "traits", "steps")  # these need no reference data


def main() -> int:
    """Run the named measurements, or all; returns the exit code."""
    parser = argparse.ArgumentParser(prog="run.py bench", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(BENCHES)}")
    told = parser.parse_args()
    unknown = [name for name in told.names if name not in BENCHES]
    if unknown:
        parser.error(f"no measurement is called {unknown[0]!r}; there are {', '.join(BENCHES)}")
    if told.names and set(told.names) <= set(OWN):
        load_patina()
        for name in told.names:
            importlib.import_module(f".bench_{name}", __package__).run(Path())
        return 0
    data = Path(os.environ.get("PATINA_SHARED", ROOT.parent / "shared")) / "data"
    if not data.is_dir():
        print(f"bench: the reference data is not here ({data.name}/ of ../shared)", file=sys.stderr)
        return 2
    load_patina()
    for name in told.names or BENCHES:
        importlib.import_module(f".bench_{name}", __package__).run(data)
    return 0


if __name__ == "__main__":
    sys.exit(main())
