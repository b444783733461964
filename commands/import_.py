"""``import CAPTURE --out FILE.blend``: mesh, lights, and cameras with photos as backgrounds.

A model of a reconstruction tool can be imported too: its cameras and sparse points, no mesh.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..core.capture import read_capture
from ..core.errors import InputError
from ..core.inputs import capture_data
from ..core.inputs.lights import find_lights
from ..core.inputs.photos import LitPhotos
from ..core.output_folder import staged_folder
from ..core.scan.formats import read_reconstruction
from .needs_blender import check_blender
from .progress import print_note

HELP = "import mesh, lights, and cameras with their photos into a .blend"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "capture", type=Path, help="the capture file (*.capture.toml), or the camera file of a scan"
    )
    parser.add_argument("--out", type=Path, required=True, help="the .blend file to write")
    parser.add_argument(
        "--images", type=Path, help="folder of the photos, if there is no capture file"
    )
    parser.add_argument(
        "--chunk",
        help="label of the chunk, for a Metashape file with several chunks and no capture file",
    )


def run(arguments: argparse.Namespace) -> None:
    check_blender("`import`", "import")
    out: Path = arguments.out
    if out.suffix != ".blend":
        raise InputError(
            "found another file type, expected a file name that ends in .blend",
            file=out,
            key="--out",
        )
    print("[  0 %] reading the scan", file=sys.stderr, flush=True)
    if arguments.capture.is_dir() or arguments.capture.suffix.lower() != ".toml":
        _import_model(arguments.capture, out, arguments.images, arguments.chunk)
        return
    for key in ("images", "chunk"):
        if getattr(arguments, key) is not None:
            raise InputError(
                f"found a capture file, which defines {key} itself; omit this option",
                key=f"--{key}",
            )
    capture = read_capture(arguments.capture)
    scan = capture_data.open_scan(capture)
    capture_data.check_photos(capture, scan)
    photos = LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    from ..scene.export.blend_file import write_import  # needs bpy

    with staged_folder(out.parent) as folder:
        _building()
        write_import(folder / out.name, out, capture, scan, lights)
    for note in (
        *scan.notes,
        *photos.notes,
        *lights.notes,
        *capture_data.size_notes(capture, scan),
    ):
        print_note(note)
    print(f"wrote {out}: {len(scan.cameras)} cameras, {len(scan.mesh.faces):,} faces")


def _import_model(model: Path, out: Path, images: Path | None, chunk: str | None) -> None:
    if images is not None and not images.is_dir():
        raise InputError("found no such folder", file=images, key="--images")
    found = read_reconstruction(model, images, chunk)
    from ..scene.export.blend_file import write_reconstruction  # needs bpy

    with staged_folder(out.parent) as folder:
        _building()
        write_reconstruction(folder / out.name, out, found, images)
    for note in found.notes:
        print_note(note)
    print(f"wrote {out}: {len(found.cameras)} cameras, {len(found.points):,} points")


def _building() -> None:
    print("[ 30 %] building the scene", file=sys.stderr, flush=True)
