"""``demo --out DIR``: the whole job on the embedded capture."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.errors import PatinaError
from ..core.report.relit import add_to_report
from .diagnose import MATERIALS, diagnose_to_folder
from .render import render_to_folder

HELP = "the whole job on the capture that comes with Patina"
RELIT = "relit"  # folder in the report
WORLDS, SIZE, SAMPLES, TURNS = ["forest"], 288, 48, 3
CAPTURE = Path(__file__).parents[1] / "assets" / "demo" / "demo.capture.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")


def run(arguments: argparse.Namespace) -> None:
    out = arguments.out
    diagnose_to_folder(CAPTURE, out)
    _show_under_other_light(out)
    page = out / MATERIALS / "index.html"
    print(f"Open {page} to see what was measured, the page above for what is wrong with it.")


def _show_under_other_light(out: Path) -> None:
    """Pictures under a world that Blender ships, where it ships any."""
    report = out / MATERIALS
    try:
        found = render_to_folder(out, report / RELIT, WORLDS, SIZE, SAMPLES, TURNS)
    except PatinaError as error:
        print(f"note: no pictures under other light ({error})")
        return
    add_to_report(report / "index.html", found, RELIT)
