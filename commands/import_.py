"""``import CAPTURE --out FILE.blend``: mesh, cameras with photos behind them, lights."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..core.capture import read_capture
from ..core.errors import InputError
from ..core.job import inputs
from .staging import staged_folder

HELP = "mesh, cameras with their photos and lights of a capture, as a .blend"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("capture", type=Path, help="the capture file (*.capture.toml)")
    parser.add_argument("--out", type=Path, required=True, help="the .blend to write")


def run(arguments: argparse.Namespace) -> None:
    out: Path = arguments.out
    if out.suffix != ".blend":
        raise InputError("expected a file name that ends in .blend", file=out, key="--out")
    print("[  0 %] reading the scan", file=sys.stderr, flush=True)
    capture = read_capture(arguments.capture)
    scan = inputs.open_scan(capture)
    inputs.check_photos(capture, scan)
    from ..scene.blend_file import write_import  # needs bpy

    with staged_folder(out.parent) as folder:
        print("[ 30 %] building the scene", file=sys.stderr, flush=True)
        write_import(folder / out.name, capture, scan)
    print(f"wrote {out}: {len(scan.cameras)} cameras, {len(scan.mesh.faces):,} faces")
