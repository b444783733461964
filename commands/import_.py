"""``import CAPTURE --out FILE.blend``: mesh, cameras with photos behind them, lights.

A folder of a COLMAP model does as well: its cameras and sparse points.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..core.capture import read_capture
from ..core.errors import InputError
from ..core.job import inputs
from ..core.scan.scan import read_reconstruction
from .staging import staged_folder

HELP = "mesh, cameras with their photos and lights of a capture, as a .blend"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "capture", type=Path, help="the capture file (*.capture.toml), or a COLMAP model folder"
    )
    parser.add_argument("--out", type=Path, required=True, help="the .blend to write")
    parser.add_argument(
        "--images", type=Path, help="folder of the photos, for a model without a capture file"
    )


def run(arguments: argparse.Namespace) -> None:
    out: Path = arguments.out
    if out.suffix != ".blend":
        raise InputError("expected a file name that ends in .blend", file=out, key="--out")
    print("[  0 %] reading the scan", file=sys.stderr, flush=True)
    if arguments.capture.is_dir():
        _import_model(arguments.capture, out, arguments.images)
        return
    if arguments.images is not None:
        raise InputError("a capture file says itself where its images lie", key="--images")
    capture = read_capture(arguments.capture)
    scan = inputs.open_scan(capture)
    inputs.check_photos(capture, scan)
    from ..scene.blend_file import write_import  # needs bpy

    with staged_folder(out.parent) as folder:
        _building()
        write_import(folder / out.name, out, capture, scan)
    print(f"wrote {out}: {len(scan.cameras)} cameras, {len(scan.mesh.faces):,} faces")


def _import_model(model: Path, out: Path, images: Path | None) -> None:
    if images is not None and not images.is_dir():
        raise InputError("no such folder", file=images, key="--images")
    cameras, points = read_reconstruction(model)
    from ..scene.blend_file import write_reconstruction  # needs bpy

    with staged_folder(out.parent) as folder:
        _building()
        write_reconstruction(folder / out.name, out, cameras, points, images)
    print(f"wrote {out}: {len(cameras)} cameras, {len(points[0]):,} points")


def _building() -> None:
    print("[ 30 %] building the scene", file=sys.stderr, flush=True)
