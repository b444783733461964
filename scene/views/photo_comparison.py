"""The photo that was looked at last, as it compares with its prediction."""

from __future__ import annotations

import bpy

from ...core.errors import PatinaError
from ...core.jobs import FitJob
from ...core.views.look_job import LookJob
from ...core.views.photo_drawing import photo_drawing
from ...core.views.photo_view import PhotoView
from ..material.measured_materials import measured_of
from ..material.trait_offsets import measured_brdf
from ..session.last_fit import kept_fit
from ..session.scene_properties import capture_path, stored_result
from ..session.session_state import Kept
from .view_image import put_view

_last: Kept[PhotoView] = Kept()


def show_photo_view(
    context: bpy.types.Context, view: PhotoView, kind: str, exposure: float
) -> bpy.types.Image:
    """Draw it as "comparison" or "samples"; it is kept until another one is."""
    _last.thing = view
    return put_view(context, kind, photo_drawing(view, kind, exposure))


def show_again(context: bpy.types.Context, kind: str, exposure: float) -> None:
    """The last one with another exposure; nothing where Blender was started since."""
    if _last.thing is not None:
        show_photo_view(context, _last.thing, kind, exposure)


def look_job(scene: bpy.types.Scene, fit: FitJob, place: int) -> LookJob:
    """Of the scene's measured materials. fit: of the scene's capture; place: of the photo in it.
    Raises PatinaError where this computer lacks their basis."""
    path = capture_path(scene)
    result = stored_result(path) or {}
    there = measured_of(path)
    scales = {m["name"]: float(m.get("scale", 1.0)) for m in result.get("materials", [])}
    brdfs = [(name, measured_brdf(material)) for name, material in there.items()]
    fitted = [(name, brdf, scales.get(name, 1.0)) for name, brdf in brdfs if brdf is not None]
    if not fitted:
        raise PatinaError(
            "the components that the materials were measured in are not on this computer: fit again"
        )
    name = fit.capture.photo_name(place)
    chosen = [
        tuple(one["pixel"])
        for material in result.get("materials", [])
        for one in material.get("chosen", [])
        if one["photo"] == name
    ]
    known = kept_fit(path, stored_result(path))
    names = [] if known is None else map(known.capture.photo_name, range(len(known.capture.photos)))
    if name not in list(names)[place : place + 1]:  # the capture file was changed since
        known = None
    return LookJob(fit.capture, fitted, place, fit.prepare, known, chosen)
