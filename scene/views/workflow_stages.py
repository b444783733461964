"""The stages of the workflow: what is present, what is missing, and the next operator."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...core.counted import counted, listed
from ...core.diagnose.effects.labels import cause_label
from ...core.fit.fit_quality import FitQuality, Rating
from ..material.measured_materials import measured_of
from ..paint.mask_images import shadow_images
from ..photos.lamp_knowledge import Source, knowledge_of
from ..photos.photo_list import PatinaPhoto, lit_photos
from ..scan.face_slots import shown_name
from ..session.lengths import length
from ..session.scene_properties import DIAGNOSIS, capture_path, stored_result
from .outdated import changes_since, inputs_now


@dataclass(frozen=True)
class Stage:
    """State of one stage.

    has: lines on what is present; missing: what remains to be done, None if nothing; press: the
    operator for it; again: label of its button when the stage is done, "" for no button; optional:
    whether later stages can start without it; doubts: sentences on what makes the stage's result
    doubtful; remedy: the operator that may resolve them, "" if there is none; outdated: whether
    something changed since the result was made.
    """

    has: tuple[str, ...] = ()
    missing: str | None = None
    press: str = ""
    again: str = ""
    optional: bool = False
    doubts: tuple[str, ...] = ()
    remedy: str = ""
    outdated: bool = False

    @property
    def done(self) -> bool:
        """Whether nothing remains to be done."""
        return self.missing is None


def stages(scene: bpy.types.Scene) -> dict[str, Stage]:
    """The stages by name, in workflow order."""
    capture, mesh = capture_path(scene), scene.patina.mesh
    there = mesh is not None and mesh.name in scene.objects
    result, diagnosis = stored_result(capture), stored_result(capture, DIAGNOSIS)
    now = inputs_now(scene) if result is not None or diagnosis is not None else {}
    return {
        "scan": _scan(mesh if there else None),
        "photos": _photos(scene, capture, lit_photos(scene)),
        "masks": _masks(scene, capture, result),
        "fit": _fit(result, changes_since(scene, now=now)),
        "check": _check(diagnosis, changes_since(scene, DIAGNOSIS, now)),
        "material": _material(capture),
    }


def next_stage(found: dict[str, Stage]) -> str | None:
    """The first required stage that is not done; if there is none, the first optional one after the
    last stage with a button. None if all are done: an optional stage that was passed is not next.
    """
    names = list(found)
    needed = [name for name in names if not (found[name].done or found[name].optional)]
    if needed:
        return needed[0]
    passed = max((i for i, n in enumerate(names) if found[n].press and found[n].done), default=-1)
    return next((n for n in names[passed + 1 :] if not found[n].done), None)


def _scan(mesh: bpy.types.Object | None) -> Stage:
    if mesh is None:
        return Stage(missing="No scan yet", press="patina.import_capture")
    faces = len(mesh.data.polygons) if mesh.type == "MESH" else 0
    corners = np.array(mesh.bound_box)
    across = float(np.ptp(corners, axis=0).max())
    return Stage((f"{mesh.name}: {faces:,} faces, {length(across)} long",))


def _photos(scene: bpy.types.Scene, capture: str, lit: list[PatinaPhoto]) -> Stage:
    if not lit:
        if scene.patina_draft.is_open:
            return Stage(missing="No lit photos yet; they come with the new capture")
        return Stage(missing="No lit photos yet; import a capture, which lists them")
    names = list(dict.fromkeys(photo.light for photo in lit))
    has = [f"{counted(len(lit), 'lit photo')}, {counted(len(names), 'light')}"]
    known = [knowledge_of(scene, capture, name) for name in names]
    guesses = [one.name for one in known if one.source is Source.GUESS]
    if not any(one.strength for one in known):
        has.append("Strength of the light unknown: reflectance up to one scale")
    lost = [one.name for one in known if one.source is Source.MISSING]
    doubts = []
    if guesses:
        verb = "is a guess" if len(guesses) == 1 else "are guesses"
        doubts.append(f"{'Light' if len(guesses) == 1 else 'Lights'} {listed(guesses)} {verb}")
    if lost:
        doubts.append(
            f"No lamp in the scene for {listed(lost)}: the fit uses the capture file's light"
        )
    remedy = "patina.find_lights" if guesses else ""
    return Stage(tuple(has), doubts=tuple(doubts), remedy=remedy)


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


def _fit(result: dict | None, changes: tuple[str, ...]) -> Stage:  # type: ignore[type-arg]
    if result is None:
        return Stage(missing="Not measured yet", press="patina.fit")
    materials = result.get("materials", [])
    has = f"{counted(len(materials), 'material')} measured"
    poor = [
        material["name"]
        for material in materials
        if FitQuality.of_result(material, result.get("varying")).rating is Rating.POOR
    ]
    doubts = _outdated(changes) + ((f"Poor fit: {listed(poor)}",) if poor else ())
    return Stage(
        (has,), press="patina.fit", again="Fit Again", doubts=doubts, outdated=bool(changes)
    )


def _outdated(changes: tuple[str, ...]) -> tuple[str, ...]:
    return (f"Outdated: {', '.join(changes)} since then",) if changes else ()


def _check(diagnosis: dict | None, changes: tuple[str, ...]) -> Stage:  # type: ignore[type-arg]
    if diagnosis is None:
        missing = "Not checked yet: do lights, cameras and mesh agree with the photos?"
        return Stage((), missing, "patina.check", optional=True)
    causes = [cause_label(cause).lower() for cause in diagnosis["named"] if cause != "none"]
    has = f"Found: {', '.join(causes)}" if causes else "No known cause found"
    doubts, outdated = _outdated(changes), bool(changes)
    return Stage(
        (has,), press="patina.check", again="Check Again", doubts=doubts, outdated=outdated
    )


def _material(capture: str) -> Stage:
    found = measured_of(capture)
    if not found:
        return Stage(missing="No measured materials yet")
    return Stage((counted(len(found), "measured material"),))
