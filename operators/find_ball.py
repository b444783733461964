"""Photos & Light stage: the direction of a lamp from a ball in the photo (a stepped job)."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ..core.capture import read_capture
from ..core.jobs.ball_job import BallJob
from ..scene.photos.ball_outline import ball_of, outline_points, put_outline
from ..scene.photos.dragged_lamps import lamp_of, mesh_frame
from ..scene.photos.found_lights import move_to_found, scan_origin
from ..scene.photos.lamp_placement import DISTANT
from ..scene.photos.photo_list import looked_at
from ..scene.property_keys import LAMP_KIND
from ..scene.session.existing_capture import existing_capture
from ..scene.session.scene_properties import capture_path
from .fit import can_fit
from .stepped import Stepped

MAX_ERROR = np.radians(3.0)  # of a direction from a ball: a larger one is a wrong outline


class PATINA_OT_find_ball(Stepped, bpy.types.Operator):
    """Measure the direction of the lamp from a chrome or glossy ball in the photo in view. The \
outline that is found can be moved and scaled; press again to measure with it"""

    bl_idname = "patina.find_ball"
    bl_label = "Find from Ball"
    PANEL = "photos"
    bl_options = {"REGISTER", "UNDO"}
    CANCELLED = "Cancelled; the lamp was not moved."

    surface: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Ball",
        description="Surface of the ball",
        items=[
            ("chrome", "Chrome", "A polished metal ball, which mirrors its surroundings"),
            ("glossy", "Glossy", "A dark, glossy ball, for example of plastic"),
        ],
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        photo = looked_at(context.scene)
        lamp = photo and lamp_of(context.scene, capture_path(context.scene), photo.light)
        if lamp is None or lamp.get(LAMP_KIND) != DISTANT:
            cls.poll_message_set("Look through a photo that a distant lamp lit")
            return False
        return can_fit(cls, context)

    def _start(self, context: bpy.types.Context) -> None:
        scene = context.scene
        capture = read_capture(existing_capture(scene.patina.capture))
        photo = looked_at(scene)
        self._place, self._light = photo.place, photo.light
        self._camera = photo.camera.name  # by name: a reference does not survive undo
        ball = ball_of(scene, capture_path(scene), photo.place)
        outline = None if ball is None else outline_points(ball, photo.camera)
        self._job = BallJob(capture, photo.place, outline, self.surface)
        self._scene = scene.name  # by name, as above

    def _finish(self, context: bpy.types.Context) -> None:
        found, scene = self._job.result, bpy.data.scenes.get(self._scene)
        camera = bpy.data.objects.get(self._camera)
        if found is None or scene is None or camera is None:
            return
        file = capture_path(scene)
        ball = put_outline(scene, file, self._place, camera, found.ring)
        for other in context.selected_objects:
            other.select_set(False)
        ball.select_set(True)
        context.view_layer.objects.active = ball
        if found.light is None:
            self.report(
                {"WARNING"},
                "No ball was found in this photo. Move (G) and scale (S) the circle onto its "
                "outline, then press Find from Ball again",
            )
            return
        for note in found.light.notes:
            self.report({"INFO"}, note)
        error = found.light.uncertainty
        if error > MAX_ERROR:
            self.report(
                {"WARNING"},
                f"The direction from the ball has an error of ± {np.degrees(error):.1f}°, so the "
                "lamp was not moved. Correct the outline: move (G) and scale (S) the circle",
            )
            return
        entry = next(e for e in self._job.capture.lights if e.name == self._light)
        entry = replace(
            entry, direction=found.light.direction, sphere=None, sun=None, guess=False,
            standard_error=error,
        )  # fmt: skip
        lamp = lamp_of(scene, file, self._light)
        if lamp is None or not move_to_found(
            lamp, entry, mesh_frame(scene, file), scan_origin(scene, file)
        ):
            self.report({"WARNING"}, f"The lamp of {self._light!r} is not in the scene")
            return
        self.report(
            {"INFO"}, f"Light {self._light!r}: direction from the ball, ± {np.degrees(error):.2f}°."
        )


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_find_ball,))
