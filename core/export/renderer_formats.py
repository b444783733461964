"""The exports for renderers: MaterialX, Mitsuba 3 and pbrt-v4."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from ..counted import counted
from . import materialx, materialx_model, mitsuba, pbrt, tensor_file
from .losses import Loss
from .subject import Subject

SPECTRAL = (
    "the spectra reproduce the RGB colours under daylight (D65); under other light the colours are "
    "a guess"
)


def write_mtlx(folder: Path, subjects: Sequence[Subject]) -> list[Loss]:
    """Write NAME.mtlx with the surfacematerials NAME (lobe stack), NAME_plain (only if the colours
    of the stack change towards grazing view) and NAME_openpbr (OpenPBR)."""
    losses = []
    for subject in subjects:
        root = materialx.document()
        stacks = {subject.id: subject.lobes.stack}
        if not subject.lobes.stack.plain:
            stacks[f"{subject.id}_plain"] = subject.lobes.plain
        errors = {}
        for name, stack in stacks.items():
            materialx.add_lobe_stack(root, name, stack)
            shown = partial(materialx_model.evaluate, stack)
            count = len(stack.lobes)
            what = f"{name}, lobe stack of {counted(count, 'lobe')}"
            errors[f"{what}, by MaterialX's own shaders"] = subject.error(shown)
            errors[f"{what}, as Blender has it"] = subject.error(stack.evaluate)
        name = f"{subject.id}_openpbr"
        surface = subject.open_pbr.surface
        materialx.add_open_pbr(root, name, surface)
        errors[f"{name}, by MaterialX's own shaders"] = subject.error(surface.evaluate)
        file = f"{subject.id}.mtlx"
        materialx.write(folder / file, root)
        losses.append(
            Loss(
                "mtlx",
                subject.name,
                (file,),
                errors,
                dropped=("the part of the BRDF that the lobes and the diffuse base cannot fit",),
                notes=subject.scale_note,
            )
        )
    return losses


def write_mitsuba(folder: Path, subjects: Sequence[Subject]) -> list[Loss]:
    """Write NAME.xml for the plugin, NAME_spectral.xml for Mitsuba's `measured`, and the plugin
    with render.py."""
    plugin = tuple(mitsuba.write_plugin(folder))
    losses = []
    for subject in subjects:
        own = mitsuba.write_material(folder, subject.material)
        tensor = _write_tensor(folder, subject)
        spectral = f"{subject.id}_spectral.xml"
        mitsuba.write_scene(folder / spectral, "measured", tensor)
        losses.append(
            Loss(
                "mitsuba",
                subject.name,
                (*own, tensor, spectral, *plugin),
                {
                    "plugin of ours (RGB variants)": 0.0,
                    "Mitsuba's own measured (spectral variants)": subject.error(
                        subject.pictures.evaluate
                    ),
                },
                notes=(SPECTRAL, *subject.scale_note),
            )
        )
    return losses


def write_pbrt(folder: Path, subjects: Sequence[Subject]) -> list[Loss]:
    """Write NAME.pbrt, and NAME.bsdf, which its `measured` material reads."""
    losses = []
    for subject in subjects:
        tensor = _write_tensor(folder, subject)
        scene = f"{subject.id}.pbrt"
        pbrt.write_scene(folder / scene, subject.id, subject.name)
        losses.append(
            Loss(
                "pbrt",
                subject.name,
                (scene, tensor),
                {"measured": subject.error(subject.pictures.evaluate)},
                notes=(SPECTRAL, *subject.scale_note),
            )
        )
    return losses


def _write_tensor(folder: Path, subject: Subject) -> str:
    """Write NAME.bsdf unless it exists; returns its name."""
    name = f"{subject.id}.bsdf"
    if not (folder / name).is_file():  # Mitsuba and pbrt share it
        fields = subject.pictures.fields(f"{subject.id}, measured with Patina")
        tensor_file.write(folder / name, fields)
    return name
