"""The stages of the workflow: what is present, what is missing, and the next operator."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...core.counted import counted
from ...core.diagnose.effects.labels import cause_label
from ..material.measured_materials import measured_of
from ..paint.mask_images import shadow_images
from ..photos.photo_list import PatinaPhoto, lit_photos
from ..scan.face_slots import shown_name
from ..session.lengths import length
from ..session.scene_properties import DIAGNOSIS, capture_path, stored_result


@dataclass(frozen=True)
class Stage:
    """State of one stage.

    has: lines on what is present; missing: what remains to be done, None if nothing; press: the
    operator for it; again: label of its button when the stage is done, "" for no button; optional:
    whether later stages can start without it.
    """

    has: tuple[str, ...] = ()
    missing: str | None = None
    press: str = ""
    again: str = ""
    optional: bool = False

    @property
    def done(self) -> bool:
        """Whether nothing remains to be done."""
        return self.missing is None


def stages(scene: bpy.types.Scene) -> dict[str, Stage]:
    """The stages by name, in workflow order."""
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
    """The first required stage that is not done; if there is none, the last optional one; None if
    all are done."""
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
        return Stage(missing="No lit photos yet; import a capture, which lists them")
    lights = {photo.light for photo in lit}
    return Stage((f"{counted(len(lit), 'lit photo')}, {counted(len(lights), 'light')}",))


def _masks(
    scene: bpy.types.Scene,
    capture: str,
    result: dict | None,  # type: ignore[type-arg]
) -> Stage:
    mesh, has = scene.patina.mesh, []
    if mesh is not None and mesh.type == "MESH" and scene.patina.use_slots:
        names = [shown_name(s.material) for s in mesh.material_slots if s.material]
        has.append(f"{counted(len(names), 'material')} on the mesh: {', '.join(names)}")
    elif result is not None:
        names = [material["name"] for material in result.get("materials", [])]
        has.append(f"{counted(len(names), 'material')}: {', '.join(names)}")
    masks = shadow_images(capture)
    if masks:
        has.append(counted(len(masks), "shadow mask"))
        return Stage(tuple(has))
    missing = "No shadow masks; shadows are computed from the mesh only"
    return Stage(tuple(has), missing, "patina.shadow_masks", optional=True)


def _fit(result: dict | None) -> Stage:  # type: ignore[type-arg]
    if result is None:
        return Stage(missing="Not measured yet", press="patina.fit")
    has = f"{counted(len(result.get('materials', [])), 'material')} measured"
    return Stage((has,), press="patina.fit", again="Fit Again")


def _check(diagnosis: dict | None) -> Stage:  # type: ignore[type-arg]
    if diagnosis is None:
        missing = "Not checked yet: do lights, cameras and mesh agree with the photos?"
        return Stage((), missing, "patina.check", optional=True)
    causes = [cause_label(cause).lower() for cause in diagnosis["named"] if cause != "none"]
    has = f"Found: {', '.join(causes)}" if causes else "No known cause found"
    return Stage((has,), press="patina.check", again="Check Again")


def _material(capture: str) -> Stage:
    found = measured_of(capture)
    if not found:
        return Stage(missing="No measured materials yet")
    return Stage((counted(len(found), "measured material"),))
