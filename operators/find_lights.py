"""Photos & Light stage: find the lights from the photos (a stepped job)."""

from __future__ import annotations

import bpy

from ..core.capture import Capture, read_capture
from ..core.jobs.find_lights_job import FindLightsJob
from ..scene.material.file_cache import own_basis
from ..scene.paint.apply_paint import apply_strokes
from ..scene.paint.mask_images import with_mask_images
from ..scene.photos.dragged_lamps import lamp_of, mesh_frame, with_dragged_lamps
from ..scene.photos.found_lights import move_to_found, scan_origin
from ..scene.photos.photo_list import looked_at
from ..scene.property_keys import FOUND_STRENGTH
from ..scene.session.existing_capture import existing_capture
from .fit import can_fit
from .stepped import Stepped


class PATINA_OT_find_lights(Stepped, bpy.types.Operator):
    """Find the direction or position of the lights from shading, highlights and shadows in the \
photos, and move the lamps there"""

    bl_idname = "patina.find_lights"
    bl_label = "Find from Photos"
    PANEL = "photos"
    bl_options = {"REGISTER", "UNDO"}
    CANCELLED = "Search cancelled; the lamps were not moved."

    light: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Light",
        description="Name of the light to find. If empty, all lights that are a guess, or else the "
        "light of the photo in view",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return can_fit(cls, context)

    def _start(self, context: bpy.types.Context) -> None:
        scene = context.scene
        path = existing_capture(scene.patina.capture)
        apply_strokes(scene)
        capture, _ = with_dragged_lamps(read_capture(path), scene)
        self._job = FindLightsJob(
            with_mask_images(capture), self._names(capture, scene), own_basis()
        )
        self._scene = scene.name  # by name: a reference does not survive undo

    def _names(self, capture: Capture, scene: bpy.types.Scene) -> tuple[str, ...]:
        if self.light:
            return (self.light,)
        guesses = tuple(entry.name for entry in capture.lights if entry.guess)
        photo = looked_at(scene)
        return guesses or (() if photo is None else (photo.light,))

    def _finish(self, context: bpy.types.Context) -> None:
        found, scene = self._job.result, bpy.data.scenes.get(self._scene)
        if found is None:
            return
        if scene is None:
            self.report({"WARNING"}, "The scene no longer exists; no lamp was moved.")
            return
        file = str(self._job.capture.file)
        frame, origin = mesh_frame(scene, file), scan_origin(scene, file)
        for entry in found.entries:
            lamp = lamp_of(scene, file, entry.name)
            if lamp is not None and entry.relative_strength is not None:
                lamp[FOUND_STRENGTH] = entry.relative_strength
            if entry.name not in found.lamps:
                continue
            if lamp is None or not move_to_found(lamp, entry, frame, origin):
                self.report(
                    {"WARNING"},
                    f"Light {entry.name!r}: its lamp is not in the scene; import the capture again",
                )
        for note in found.notes:
            self.report({"INFO"}, note)


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_find_lights,))
