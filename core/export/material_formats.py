"""Write the materials of a result in one or more formats."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from ..concurrency.background import in_background
from ..concurrency.job import Step
from ..errors import InputError
from ..output_folder import staged_folder
from ..result import FittedMaterial, FittedResult
from . import renderer_formats, table_formats, web_format
from .file_names import check_distinct
from .losses import Loss, write_losses
from .subject import Subject

PLAIN: dict[str, Callable[[Path, Sequence[Subject]], list[Loss]]] = {
    "binary": table_formats.write_binary,
    "exr": table_formats.write_exr,
    "npz": table_formats.write_npz,
    "mtlx": renderer_formats.write_mtlx,
    "mitsuba": renderer_formats.write_mitsuba,
    "pbrt": renderer_formats.write_pbrt,
    "web": web_format.write_web,
}
"""Format → its writer, which needs no Blender."""

BLENDER = ("blend", "gltf", "usd")  # written by scene/export/export_formats.py
FORMATS = (*BLENDER, *PLAIN)
WITH_MAPS = ("gltf", "usd")  # that take the maps of the result's scene.blend
VARIATION = "the variation over the surface; the command `maps` writes it as images"

BlenderWriter = Callable[[str, Path, Path, FittedResult, Sequence[Subject]], list[Loss]]
"""(format, folder to write into, folder that the files will be moved to, result, materials)."""


def export_materials(
    out: Path,
    result: FittedResult,
    formats: Sequence[str],
    names: Sequence[str] | None = None,
    by_blender: BlenderWriter | None = None,
) -> Generator[Step, None, tuple[list[Loss], list[str]]]:
    """Write a result's materials (``names``: only these) into a folder, in steps. Returns what each
    format loses of each material, and the lines of losses.txt.

    by_blender: writes the formats of BLENDER, which open a .blend of their own in place of the one
    that is open. Raises InputError for unknown materials and folders that cannot be written.
    """
    selected = _selected_materials(result, names)
    check_distinct([material.name for material in selected])
    _check_other_folder(out, result, formats)
    formats = list(dict.fromkeys(formats))
    subjects = [Subject(material) for material in selected]
    losses: list[Loss] = []
    with staged_folder(out) as folder:
        for done, name in enumerate(formats):
            step = Step(f"writing {name}", done / len(formats))
            yield step
            if name in PLAIN:
                losses += yield from in_background(partial(PLAIN[name], folder, subjects), step)
            elif by_blender is None:
                raise InputError(f"the format {name} needs Blender", key="formats")
            else:
                losses += by_blender(name, folder, out, result, subjects)
        losses = [_without_variation(loss, result) for loss in losses]
        lines = write_losses(folder, losses, ", ".join(s.name for s in subjects))
    return losses, lines


def _without_variation(loss: Loss, result: FittedResult) -> Loss:
    """The losses with that of the variation over the surface, in formats without maps."""
    if loss.format in WITH_MAPS or loss.material not in result.varying_names:
        return loss
    return replace(loss, dropped=(*loss.dropped, VARIATION))


def _selected_materials(result: FittedResult, names: Sequence[str] | None) -> list[FittedMaterial]:
    """Return the materials to export, in the order of the result. Raises InputError."""
    if names is None:
        return list(result.materials)
    known = [material.name for material in result.materials]
    for name in names:
        if name not in known:
            raise InputError(
                f"found no material named {name!r}; expected one of {', '.join(known)}",
                file=result.file,
                key="--material",
            )
    return [material for material in result.materials if material.name in names]


def _check_other_folder(out: Path, result: FittedResult, formats: Sequence[str]) -> None:
    """Raise InputError if ``out`` is the folder of the result, whose files must not be replaced."""
    if out.resolve() == result.file.parent.resolve():
        raise InputError(
            f"is the folder of the result; expected another folder ({'/'.join(formats)} would mix "
            "with the files of the fit)",
            file=out,
            key="--out",
        )
