"""The outline of a ball in a lit photo, as a circle in front of the photo's camera: it is moved and
scaled like any object."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ..property_keys import BALL_PHOTO, CAPTURE
from .lamp_placement import FROM_CAMERA

Array = NDArray[np.float64]

DEPTH = 20.0  # of the circle, in units of the camera's clip start, which is 1 % of the distance


def ball_of(scene: bpy.types.Scene, capture: str, place: int) -> bpy.types.Object | None:
    """The outline of the ball in a photo of a capture, or None. place: index of the photo."""
    for thing in scene.objects:
        if thing.get(CAPTURE) == capture and thing.get(BALL_PHOTO) == place:
            return thing
    return None


def put_outline(
    scene: bpy.types.Scene, capture: str, place: int, camera: bpy.types.Object, ring: Array
) -> bpy.types.Object:
    """Create or move the outline. ring: (n, 3) points in the camera's axes (x right, y down, z
    forward), at z = 1."""
    ball = ball_of(scene, capture, place)
    if ball is None:
        turn = np.arange(64) / 64 * 2 * np.pi
        data = bpy.data.meshes.new("Ball")
        points = np.stack([np.cos(turn), np.sin(turn), np.zeros(64)], axis=1)
        data.from_pydata(points.tolist(), [(i, (i + 1) % 64) for i in range(64)], [])
        ball = bpy.data.objects.new("Ball", data)
        ball[CAPTURE], ball[BALL_PHOTO] = capture, place
        ball.show_in_front = ball.hide_render = True
        camera.users_collection[0].objects.link(ball)
    depth = 1.0 if camera.data.type == "ORTHO" else DEPTH * camera.data.clip_start
    local = ring * FROM_CAMERA * (1.0 if camera.data.type == "ORTHO" else depth)
    centre = local.mean(axis=0)
    radius = float(np.linalg.norm(local - centre, axis=1).mean())
    ball.parent, ball.parent_type = camera, "OBJECT"
    ball.matrix_parent_inverse.identity()
    ball.location, ball.scale = centre.tolist(), (radius, radius, radius)
    ball.rotation_euler = (0.0, 0.0, 0.0)
    return ball


def outline_points(ball: bpy.types.Object, camera: bpy.types.Object) -> Array:
    """(n, 3) points of the outline in the camera's axes (x right, y down, z forward)."""
    matrix = np.array(camera.matrix_world.inverted_safe() @ ball.matrix_world)
    points = np.array([vertex.co for vertex in ball.data.vertices])
    return (points @ matrix[:3, :3].T + matrix[:3, 3]) * FROM_CAMERA


def show_only(scene: bpy.types.Scene, capture: str, place: int) -> None:
    """Show the outline in the photo that is looked at, and hide those of the others."""
    for thing in scene.objects:
        if BALL_PHOTO in thing and thing.get(CAPTURE) == capture:
            for layer in scene.view_layers:
                if thing.name in layer.objects:  # its collection may be excluded
                    thing.hide_set(thing[BALL_PHOTO] != place, view_layer=layer)
