"""``demo --out DIR``: the whole job on the embedded capture."""

from __future__ import annotations

import argparse
from pathlib import Path

from .fit import fit_to_folder

HELP = "the whole job on the capture that comes with Patina"
CAPTURE = Path(__file__).parents[1] / "assets" / "demo" / "demo.capture.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")


def run(arguments: argparse.Namespace) -> None:
    fit_to_folder(CAPTURE, arguments.out)
    print(f"Open {arguments.out / 'report' / 'index.html'} to see what was measured.")
