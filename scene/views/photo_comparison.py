"""Comparison of a photo with its prediction; the last one is kept."""

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
from ..session.session_state import KeptValue
from .view_image import put_view

_last: KeptValue[PhotoView] = KeptValue()


def show_photo_view(
    context: bpy.types.Context, view: PhotoView, kind: str, exposure: float
) -> bpy.types.Image:
    """Draw a view of a photo as "comparison" or "samples", and keep it as the last one."""
    _last.value = view
    return put_view(context, kind, photo_drawing(view, kind, exposure))


def redraw_last_view(context: bpy.types.Context, kind: str, exposure: float) -> None:
    """Draw the last view with another exposure; nothing if materials is none in this session."""
    if _last.value is not None:
        show_photo_view(context, _last.value, kind, exposure)


def look_job(scene: bpy.types.Scene, fit: FitJob, place: int) -> LookJob:
    """The job that predicts a photo from the scene's measured materials.

    fit: a fit of the scene's capture; place: index of the photo in it. Raises PatinaError if the
    basis of the materials is not on this computer.
    """
    path = capture_path(scene)
    result = stored_result(path) or {}
    materials = measured_of(path)
    scales = {m["name"]: float(m.get("scale", 1.0)) for m in result.get("materials", [])}
    brdfs = [(name, measured_brdf(material)) for name, material in materials.items()]
    fitted = [(name, brdf, scales.get(name, 1.0)) for name, brdf in brdfs if brdf is not None]
    if not fitted:
        raise PatinaError(
            "The basis of the materials is not on this computer; fit the materials again"
        )
    name = fit.capture.photo_name(place)
    selected = [
        tuple(sample["pixel"])
        for material in result.get("materials", [])
        for sample in material.get("chosen", [])
        if sample["photo"] == name
    ]
    known = kept_fit(path, stored_result(path))
    names = [] if known is None else map(known.capture.photo_name, range(len(known.capture.photos)))
    if name not in list(names)[place : place + 1]:  # the capture file has changed since the fit
        known = None
    return LookJob(fit.capture, fitted, place, fit.prepare, known, selected)
