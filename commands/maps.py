"""``maps CAPTURE RESULT --out DIR``: maps of colour and gloss over the UVs of the mesh."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from ..core.brdf import merl_file
from ..core.capture import read_capture
from ..core.errors import InputError
from ..core.jobs import finished
from ..core.maps import MapsJob, MapsSettings
from ..core.maps.maps_job import REFITS, MapsResult
from ..core.maps.texels import check_size
from ..core.maps.write import write_maps
from ..core.output_folder import check_out, staged_folder
from ..core.report import result_json
from ..core.result import read_result
from ..core.scan.mesh_formats.write_ply import write_ply
from ..core.varying import storage
from ..core.varying.displacement import displaced_mesh
from .fit import NO_SCENE, timed
from .needs_blender import has_blender
from .progress import Progress, print_note

DISPLACED = "displaced.ply"
HELP = "compute maps of base colour (without lighting), roughness and coverage over the UVs"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("capture", type=Path, help="the capture file (*.capture.toml)")
    parser.add_argument("result", type=Path, help="the output folder of `fit`, or its result.json")
    parser.add_argument("--out", type=Path, required=True, help="folder for the maps")
    parser.add_argument(
        "--size",
        type=int,
        default=2048,
        help="width and height of a map in texels (default %(default)s)",
    )
    parser.add_argument(
        "--keep-fit",
        action="store_true",
        help="do not fit materials with varying colour again (faster; less accurate highlights)",
    )
    parser.add_argument(
        "--normal",
        action="store_true",
        help="also write a normal map that corrects the errors of the mesh normals",
    )
    parser.add_argument(
        "--displaced",
        action="store_true",
        help="also write displaced.ply, a finer mesh with the relief of the normals of a result of "
        "`fit --varying`",
    )
    parser.add_argument(
        "--format",
        choices=("exr", "png"),
        default="exr",
        help="file format of the maps (default %(default)s)",
    )


def run(arguments: argparse.Namespace) -> None:
    check_size(arguments.size)
    out = check_out(arguments.out)
    capture, fitted = read_capture(arguments.capture), read_result(arguments.result)
    varying = fitted.varying
    if arguments.displaced and varying is None:
        raise InputError(
            "its materials are even, so there is no relief; expected a result of `fit --varying`",
            file=arguments.result,
            key="--displaced",
        )
    blender = has_blender()
    if blender:
        from ..scene.scan.unwrap import unwrapped  # needs bpy

    settings = MapsSettings(arguments.size, 0 if arguments.keep_fit else REFITS, arguments.normal)
    job = MapsJob(capture, fitted, settings, unwrapped if blender else None)
    progress = Progress(share=0.9)
    job.drain(progress)
    result = finished(job.result)
    progress.share = 1.0
    with staged_folder(out, _owner, print_note) as folder:
        stages = [*job.stages]
        with timed(stages, "maps", progress, 0.92):
            files = write_maps(folder, result, arguments.format)
        if arguments.displaced and varying is not None:
            with timed(stages, DISPLACED, progress, 0.95):
                surface = storage.read(varying, result.scan.mesh, len(result.materials))
                made = displaced_mesh(surface)
                write_ply(folder / DISPLACED, made.vertices, made.faces, made.uv)
        scene = folder / "scene.blend"
        notes: Sequence[str] = (NO_SCENE,)
        if blender:
            with timed(stages, scene.name, progress, 0.96):
                from ..scene.export.maps_blend import write_mapped_blend

                final = out / scene.name
                notes = write_mapped_blend(scene, final, result, files, fitted.scene, stages)
        written = scene.is_file()
        if result.refit is not None:
            for material in result.refit.materials:
                merl_file.write(folder / f"{material.name}.binary", material.fit.brdf.table())
            result_json.write(folder / "result.json", result.refit, stages, result.notes)
    _print_summary(result)
    for note in (*result.notes, *notes):
        print_note(note)
    print(f"wrote {len(files)} maps and {out / 'maps.json'}")
    also = (
        (DISPLACED, arguments.displaced),
        ("scene.blend", written),
        ("result.json", result.refit is not None),
    )
    for name in (name for name, is_written in also if is_written):
        print(f"      {out / name}")


def _owner(name: str) -> str:
    """What writes a file: that of a refit is not removed by maps without one."""
    return "refit" if name == "result.json" or name.endswith(".binary") else "maps"


def _print_summary(result: MapsResult) -> None:
    maps = result.maps
    lit = maps.photos > 0
    print(
        f"{len(result.texels):,} texels in maps of {result.texels.size} × {result.texels.size}; "
        f"{100 * lit.mean():.0f} % are visible and lit in at least one photo"
    )
    for index, level in enumerate(result.levels):
        lit_texels = lit & (maps.material == index)
        if not lit_texels.any():
            print(
                f"{level.name}: No photo shows it lit. Its maps hold the uniform fitted material."
            )
            continue
        error = float(sorted(maps.error[lit_texels])[int(lit_texels.sum()) // 2])
        scale = sorted(maps.materials[index].scale[lit_texels] @ level.channels)
        low, middle, high = (scale[int(q * len(scale))] for q in (0.16, 0.5, 0.84))
        print(
            f"{level.name}: brightness varies by ± {50 * (high - low) / middle:.0f} %; "
            f"standard error ± {100 * error:.0f} % (median texel)"
        )
