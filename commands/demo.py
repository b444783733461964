"""``demo --out DIR``: diagnose the embedded capture and render the results."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.errors import PatinaError
from ..core.output_folder import record_again
from ..core.report.relit import add_to_report
from .diagnose import MATERIALS, diagnose_to_folder
from .fit import fit_to_folder
from .render import render_to_folder

HELP = "diagnose the capture that comes with Patina, and render its materials"
RELIT = "relit"  # folder in the report, for pictures under other light
WORLDS, SIZE, SAMPLES, TURNS = ["forest"], 288, 48, 3
ASSETS = Path(__file__).parents[1] / "assets"
CAPTURE, WORN = ASSETS / "demo" / "demo.capture.toml", ASSETS / "worn" / "worn.capture.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument(
        "--worn",
        action="store_true",
        help="fit the second one: a painted jar that is worn and dirty",
    )


def run(arguments: argparse.Namespace) -> None:
    out = arguments.out
    if arguments.worn:
        fit_to_folder(WORN, out, varying="auto")
        print(f"Open {out / 'report' / 'index.html'}: what varies over the jar, and the viewer.")
        return
    diagnose_to_folder(CAPTURE, out)
    _show_under_other_light(out)
    print(
        f"Open {out / 'report' / 'index.html'}: what is wrong with the capture, and the materials."
    )


def _show_under_other_light(out: Path) -> None:
    """Render the materials under a world that Blender ships, and add the pictures to the report.

    Prints a note if Blender or the world is not available.
    """
    report = out / MATERIALS
    try:
        found = render_to_folder(out, report / RELIT, WORLDS, SIZE, SAMPLES, TURNS)
    except PatinaError as error:
        print(f"note: The materials were not rendered under other light ({error}).")
        return
    page = report / "index.html"
    add_to_report(page, found, RELIT)
    record_again(out, page)
