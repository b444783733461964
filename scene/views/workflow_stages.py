"""The stages of the work: what each has, what it lacks, and what to press next."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ..material.measured_materials import measured_of
from ..paint.mask_images import shadow_images
from ..photos.photo_list import PatinaPhoto, lit_photos
from ..scan.face_slots import shown_name
from ..session.lengths import length
from ..session.scene_properties import DIAGNOSIS, capture_path, stored_result


@dataclass(frozen=True)
class Stage:
    """has: what is there, a line each; missing: what is to be done, None where nothing is; press:
    the operator that does it; again: what its button says where it is done; optional: whether the
    next stage does not wait for it."""

    has: tuple[str, ...] = ()
    missing: str | None = None
    press: str = ""
    again: str = ""
    optional: bool = False

    @property
    def done(self) -> bool:
        """Whether nothing is left to do."""
        return self.missing is None


def stages(scene: bpy.types.Scene) -> dict[str, Stage]:
    """By name, in the order of the work."""
    capture, mesh = capture_path(scene), scene.patina.mesh
    there = mesh is not None and mesh.name in scene.objects
    result, diagnosis = stored_result(capture), stored_result(capture, DIAGNOSIS)
    return {
        "scan": _scan(mesh if there else None),
        "photos": _photos(lit_photos(scene)),
        "masks": _masks(scene, capture, result),
        "fit": _fit(result),
        "check": _check(diagnosis),
        "material": _material(capture),
    }


def next_stage(found: dict[str, Stage]) -> str | None:
    """The first that is not done and that the rest waits for; where none is, the last of those that
    nothing waits for."""
    waiting = [name for name, stage in found.items() if not stage.done]
    needed = [name for name in waiting if not found[name].optional]
    return next(iter(needed or waiting[::-1]), None)


def _scan(mesh: bpy.types.Object | None) -> Stage:
    if mesh is None:
        return Stage(missing="No scan yet", press="patina.import_capture")
    faces = len(mesh.data.polygons) if mesh.type == "MESH" else 0
    corners = np.array(mesh.bound_box)
    across = float(np.ptp(corners, axis=0).max())
    return Stage((f"{mesh.name}: {faces:,} faces, {length(across)} long",))


def _photos(lit: list[PatinaPhoto]) -> Stage:
    if not lit:
        return Stage(missing="No lit photos yet: a capture names them")
    lights = {photo.light for photo in lit}
    return Stage((f"{_many(len(lit), 'lit photo')}, {_many(len(lights), 'light')}",))


def _masks(
    scene: bpy.types.Scene,
    capture: str,
    result: dict | None,  # type: ignore[type-arg]
) -> Stage:
    mesh, has = scene.patina.mesh, []
    if mesh is not None and mesh.type == "MESH" and scene.patina.use_slots:
        names = [shown_name(s.material) for s in mesh.material_slots if s.material]
        has.append(f"{_many(len(names), 'material')} on the mesh: {', '.join(names)}")
    elif result is not None:
        names = [material["name"] for material in result.get("materials", [])]
        has.append(f"{_many(len(names), 'material')}: {', '.join(names)}")
    masks = shadow_images(capture)
    if masks:
        has.append(_many(len(masks), "shadow mask"))
        return Stage(tuple(has))
    said = "No shadow masks: shadows are then found from the mesh alone"
    return Stage(tuple(has), said, "patina.shadow_masks", optional=True)


def _fit(result: dict | None) -> Stage:  # type: ignore[type-arg]
    if result is None:
        return Stage(missing="Not measured yet", press="patina.fit")
    has = f"{_many(len(result.get('materials', [])), 'material')} measured"
    return Stage((has,), press="patina.fit", again="Fit Anew")


def _check(diagnosis: dict | None) -> Stage:  # type: ignore[type-arg]
    if diagnosis is None:
        said = "Not checked yet: is the light, the camera, the mesh what the capture says?"
        return Stage((), said, "patina.check", optional=True)
    named = [cause.replace("_", " ") for cause in diagnosis["named"] if cause != "none"]
    has = f"Found: {', '.join(named)}" if named else "Nothing that can be named"
    return Stage((has,), press="patina.check", again="Check Anew")


def _material(capture: str) -> Stage:
    found = measured_of(capture)
    if not found:
        return Stage(missing="Nothing measured yet")
    return Stage((_many(len(found), "measured material"),))


def _many(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"
