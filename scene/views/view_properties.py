"""Settings of the views of measured materials: Scene.patina_views."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import Any

import bpy

from ...core.brdf import merl_file
from ...core.errors import PatinaError
from ...core.views.charts import CHARTS, View, best_sampled_theta_d, chart
from ...core.views.photo_drawing import KINDS
from ...core.views.subject import Show, Subject
from ..material.material_evidence import earlier_subject, subject_of
from ..material.trait_offsets import edited_brdf
from ..material.trait_properties import shown_material
from ..property_keys import MEASURED_NAME
from ..session.handlers import register_property_factory
from .photo_comparison import redraw_last_view
from .view_image import put_view, view_image

log = logging.getLogger(__name__)

NONE, EARLIER, CHANGED, MATERIAL, FILE = "NONE", "EARLIER", "CHANGED", "MATERIAL", "FILE"
AGAINST = (
    (NONE, "Nothing", "Show only the material"),
    (EARLIER, "Earlier Fit", "The material as measured by the previous fit"),
    (CHANGED, "Changed Traits", "The material as edited with the sliders of Change Traits"),
    (MATERIAL, "Material", "Another measured material of this file"),
    (FILE, "MERL File", "A BRDF in the format of the MERL database (*.binary)"),
)
SCALES = (
    ("cube_root", "Cube Root", "Cube root of the BRDF, which shows both highlight and body"),
    ("linear", "Linear", "Lengths are proportional to the BRDF"),
    ("log", "Log", "Logarithmic, three decades below the maximum"),
)
CHANNELS = (
    ("rgb", "RGB", "Show red, green and blue separately"),
    ("r", "R", "Show only red"),
    ("g", "G", "Show only green"),
    ("b", "B", "Show only blue"),
    ("mean", "Mean", "Show the mean of red, green and blue"),
)


_setting_default = False  # True while _set_default_angle runs, so that the chart is drawn only once


def _changed(views: PatinaViews, context: bpy.types.Context) -> None:
    """Redraw the view that was shown last."""
    if _setting_default or view_image(views.shown) is None:
        return
    if views.shown in KINDS:
        redraw_last_view(context, views.shown, views.exposure)
    elif views.shown in CHARTS:
        try:
            show_chart(context, views.shown)
        except PatinaError as error:
            log.info("The chart cannot be redrawn: %s", error)


def _degrees(name: str, description: str, default: float) -> Any:
    return bpy.props.FloatProperty(
        name=name, description=description, subtype="ANGLE", default=math.radians(default),
        min=0.0, max=math.radians(89.0), step=100, precision=1, options=set(), update=_changed,
    )  # fmt: skip


def _measured(views: PatinaViews, material: bpy.types.Material) -> bool:
    return MEASURED_NAME in material


class PatinaViews(bpy.types.PropertyGroup):
    """Scene.patina_views."""

    shown: bpy.props.StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]
    material: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Material",
        description="Measured material to show; if empty, the selected one",
        type=bpy.types.Material,
        poll=_measured,
        update=_changed,
    )
    against: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Compare With",
        description="BRDF to compare with, drawn dashed or next to the material",
        items=AGAINST,
        options=set(),
        update=_changed,
    )
    other: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Other Material",
        description="Measured material to compare with",
        type=bpy.types.Material,
        poll=_measured,
        update=_changed,
    )
    file: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="MERL File",
        description="BRDF to compare with, in the format of the MERL database (*.binary)",
        subtype="FILE_PATH",
        update=_changed,
    )
    scale: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Scale",
        description="Scale of lengths and brightness in charts",
        items=SCALES,
        options=set(),
        update=_changed,
    )
    channels: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Channels",
        description="Colour channels to show",
        items=CHANNELS,
        options=set(),
        update=_changed,
    )
    cosine: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Times N·L",
        description="Multiply by the cosine of the angle of incidence, which gives the radiance of "
        "a lit surface",
        options=set(),
        update=_changed,
    )
    incidence: _degrees(  # type: ignore[valid-type]
        "Light Angle", "Angle between normal and light in the polar slice", 45.0
    )
    theta_d: _degrees(  # type: ignore[valid-type]
        "Difference Angle",
        "Angle θd of the highlight curve, half the angle between light and view",
        20.0,
    )
    phi_d: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Azimuth",
        description="Azimuth φd of the slices: at 90° light and view are symmetric, at 0° both are "
        "in the plane of the normal and the half vector",
        subtype="ANGLE",
        default=math.radians(90.0),
        min=0.0,
        max=math.pi,
        step=100,
        precision=1,
        options=set(),
        update=_changed,
    )
    exposure: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Exposure",
        description="Exposure of the sphere and the photos, in stops, for display only",
        min=-10.0,
        max=10.0,
        soft_min=-4.0,
        soft_max=4.0,
        step=10,
        precision=1,
        options=set(),
        update=_changed,
    )


def looked_at(context: bpy.types.Context) -> bpy.types.Material | None:
    """The material that the views show; None if there is no measured material."""
    material = context.scene.patina_views.material
    return material if material is not None else shown_material(context)


def show_chart(context: bpy.types.Context, kind: str) -> bpy.types.Image:
    """Draw one of CHARTS; returns its image. Raises PatinaError if there is no measured material or
    nothing to compare with."""
    views, material = context.scene.patina_views, looked_at(context)
    if material is None:
        raise PatinaError("There is no measured material in this file; fit the materials first")
    subject = subject_of(material)
    if kind == "highlight" and not views.is_property_set("theta_d"):
        _set_default_angle(views, subject)
    drawing = chart(kind, subject, _other(views, material), _view(views))
    views.shown = kind
    return put_view(context, kind, drawing)


def _set_default_angle(views: PatinaViews, subject: Subject) -> None:
    """Set the angle of the highlight curve to that with the most samples, until the user sets
    one."""
    global _setting_default
    best = best_sampled_theta_d(subject)
    if best is None:
        return
    _setting_default = True
    try:
        views.theta_d = math.radians(best)
    finally:
        _setting_default = False


def _view(views: PatinaViews) -> View:
    return View(
        show=Show(views.scale, views.cosine, views.channels),
        incidence=math.degrees(views.incidence),
        theta_d=round(math.degrees(views.theta_d), 1),
        phi_d=round(math.degrees(views.phi_d), 1),
        exposure=views.exposure,
    )


def _other(views: PatinaViews, material: bpy.types.Material) -> Subject | None:
    if views.against == EARLIER:
        return earlier_subject(material)
    if views.against == CHANGED:
        brdf = edited_brdf(material)
        return None if brdf is None else Subject("changed", brdf.evaluate)
    if views.against == MATERIAL:
        if views.other is None:
            raise PatinaError("No material to compare with; choose one below Compare With")
        return subject_of(views.other)
    if views.against == FILE:
        if not views.file:
            raise PatinaError("No file to compare with; choose one below Compare With")
        path = Path(bpy.path.abspath(views.file))
        return Subject(path.stem, merl_file.read(path).evaluate)
    return None


register, unregister = register_property_factory(bpy.types.Scene, "patina_views", PatinaViews)
