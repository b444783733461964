"""``localise SCAN --photos LIT … --out DIR``: camera poses of further photos of a scan."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.capture.reader import read_scan_entry
from ..core.errors import InputError, PatinaError
from ..core.output_folder import check_out, staged_folder
from ..core.scan import Camera, Mesh
from ..core.scan.formats import read_reconstruction
from ..core.scan.readers.colmap import is_colmap
from ..core.scan.scan import read_scan
from ..core.solve import LocaliseJob, find_photos
from .progress import Progress, print_note
from .solve import check_threads

HELP = "compute camera poses of lit photos that are not part of the scan"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scan", type=Path, help="the capture file (*.capture.toml), or the camera file of a scan"
    )
    parser.add_argument("--mesh", type=Path, help="mesh of the scan, if there is no capture file")
    parser.add_argument(
        "--images", type=Path, help="folder of the photos of the scan, if there is no capture file"
    )
    parser.add_argument("--chunk", help="label of the Metashape chunk, if there is no capture file")
    parser.add_argument(
        "--photos", type=Path, nargs="+", required=True, help="the lit photos, or their folders"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument(
        "--threads", type=int, help="maximum number of threads (default: one per core)"
    )


def run(arguments: argparse.Namespace) -> None:
    check_threads(arguments.threads)
    out = check_out(arguments.out)
    photos = _photos(arguments.photos)
    cameras, mesh, images, model, notes = _scan(arguments)
    job = LocaliseJob(cameras, images, photos, mesh, model, arguments.threads)
    try:
        job.drain(Progress())
    finally:
        job.cancel()
    result = job.result
    for note in (*notes, *result.notes):
        print_note(note)
    if result.placed:
        with staged_folder(out, "localise", print_note) as folder:
            name = result.write(folder).name
        for found in result.placed:
            print(f"  {found.sentence()}")
        print(f'wrote {out / name}; add extra = "{name}" to [scan] of the capture file')
    if result.rejected:
        more = f" (and {len(result.rejected) - 1} more)" if len(result.rejected) > 1 else ""
        count = f"{len(result.placed)} of {len(photos)} photos localised; "
        raise PatinaError(f"{count}{result.rejected[0]}{more}")


def _photos(given: list[Path]) -> list[Path]:
    found: list[Path] = []
    for path in given:
        if path.is_dir():
            found += [photo.path for photo in find_photos(path)]
        elif path.is_file():
            found.append(path)
        else:
            raise InputError("found no such file or folder", file=path, key="--photos")
    return found


def _scan(
    arguments: argparse.Namespace,
) -> tuple[tuple[Camera, ...], Mesh | None, Path, Path | None, tuple[str, ...]]:
    """Return (cameras, mesh, folder of the photos, COLMAP model if there is no mesh, notes).

    Raises InputError.
    """
    cameras, mesh, images, chunk, frame = (
        arguments.scan,
        arguments.mesh,
        arguments.images,
        arguments.chunk,
        None,
    )
    if arguments.scan.is_file() and arguments.scan.suffix.lower() == ".toml":
        for key in ("mesh", "images", "chunk"):
            if getattr(arguments, key) is not None:
                raise InputError(
                    f"found a capture file, which defines {key} itself; omit this option",
                    key=f"--{key}",
                )
        entry = read_scan_entry(arguments.scan)
        cameras, mesh, images = entry.cameras, entry.mesh, entry.images
        chunk, frame = entry.chunk, entry.frame
    if images is None:
        raise InputError(
            "found no folder of the scan's photos, which are needed to match new photos; add it",
            key="--images",
        )
    if not images.is_dir():
        raise InputError("found no such folder", file=images, key="--images")
    if mesh is not None:
        scan = read_scan(cameras, mesh, images, chunk, frame)
        return scan.cameras, scan.mesh, images, None, scan.notes
    found = read_reconstruction(cameras, images, chunk)
    model = cameras if cameras.is_dir() and is_colmap(cameras) else None
    return found.cameras, None, images, model, found.notes
