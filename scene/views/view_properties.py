"""How views of measured materials are looked at: Scene.patina_views."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import Any

import bpy

from ...core.brdf import merl_file
from ...core.errors import PatinaError
from ...core.views.charts import CHARTS, View, chart, most_measured
from ...core.views.photo_drawing import KINDS
from ...core.views.subject import Show, Subject
from ..material.material_evidence import earlier_subject, subject_of
from ..material.trait_offsets import moved_brdf
from ..material.trait_properties import shown_material
from ..property_keys import MEASURED_NAME
from ..session.handlers import register_property_factory
from .photo_comparison import show_again
from .view_image import put_view, view_image

log = logging.getLogger(__name__)

NONE, EARLIER, CHANGED, MATERIAL, FILE = "NONE", "EARLIER", "CHANGED", "MATERIAL", "FILE"
AGAINST = (
    (NONE, "Nothing", "The material alone"),
    (EARLIER, "Earlier Fit", "What the material was before it was fitted again"),
    (CHANGED, "Changed Traits", "What the sliders of Change Traits have made of it"),
    (MATERIAL, "Material", "Another measured material of this file"),
    (FILE, "MERL File", "A BRDF in the MERL database's format (*.binary)"),
)
SCALES = (
    ("cube_root", "Cube Root", "Lobe and body both show, as in the MERL database's own pictures"),
    ("linear", "Linear", "Lengths are reflectances"),
    ("log", "Log", "Three decades below the top"),
)
CHANNELS = (
    ("rgb", "RGB", "Each of red, green and blue"),
    ("r", "R", "Red only"),
    ("g", "G", "Green only"),
    ("b", "B", "Blue only"),
    ("mean", "Mean", "The mean of red, green and blue"),
)


_suiting = False  # while a setting is found for the artist: the chart is drawn once, with it


def _changed(views: PatinaViews, context: bpy.types.Context) -> None:
    """What was shown last follows."""
    if _suiting or view_image(views.shown) is None:
        return
    if views.shown in KINDS:
        show_again(context, views.shown, views.exposure)
    elif views.shown in CHARTS:
        try:
            show_chart(context, views.shown)
        except PatinaError as error:
            log.info("the chart does not follow: %s", error)


def _degrees(name: str, said: str, default: float) -> Any:
    return bpy.props.FloatProperty(
        name=name, description=said, subtype="ANGLE", default=math.radians(default),
        min=0.0, max=math.radians(89.0), step=100, precision=1, options=set(), update=_changed,
    )  # fmt: skip


def _measured(views: PatinaViews, material: bpy.types.Material) -> bool:
    return MEASURED_NAME in material


class PatinaViews(bpy.types.PropertyGroup):
    """Scene.patina_views."""

    shown: bpy.props.StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]
    material: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Material",
        description="The measured material to look at; none: the one that is selected",
        type=bpy.types.Material,
        poll=_measured,
        update=_changed,
    )
    against: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Compare With",
        description="What is drawn dashed, or beside it",
        items=AGAINST,
        options=set(),
        update=_changed,
    )
    other: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Other Material",
        description="The measured material to compare with",
        type=bpy.types.Material,
        poll=_measured,
        update=_changed,
    )
    file: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="MERL File",
        description="A BRDF in the MERL database's format (*.binary)",
        subtype="FILE_PATH",
        update=_changed,
    )
    scale: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Scale",
        description="How lengths and brightness stand for reflectance",
        items=SCALES,
        options=set(),
        update=_changed,
    )
    channels: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Channels",
        description="Which color channels are shown",
        items=CHANNELS,
        options=set(),
        update=_changed,
    )
    cosine: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Times N·L",
        description="Multiply by the cosine of incidence: what a surface sends out for a light",
        options=set(),
        update=_changed,
    )
    incidence: _degrees(  # type: ignore[valid-type]
        "Light At", "Angle between normal and light of the polar slice", 45.0
    )
    theta_d: _degrees(  # type: ignore[valid-type]
        "Half Angle",
        "θd of the highlight curve: half the angle between light and view",
        20.0,
    )
    phi_d: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Azimuth",
        description="φd of the slices: 90° treats light and view alike, at 0° both lie in the "
        "plane of the normal and the half vector",
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
        description="Of the sphere and the photos, in stops, for looking only",
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
    """The material that views show."""
    chosen = context.scene.patina_views.material
    return chosen if chosen is not None else shown_material(context)


def show_chart(context: bpy.types.Context, kind: str) -> bpy.types.Image:
    """Draw one of CHARTS anew. Raises PatinaError."""
    views, material = context.scene.patina_views, looked_at(context)
    if material is None:
        raise PatinaError("there is no measured material in this file: fit first")
    subject = subject_of(material)
    if kind == "highlight" and not views.is_property_set("theta_d"):
        _suit(views, subject)
    drawing = chart(kind, subject, _other(views, material), _view(views))
    views.shown = kind
    return put_view(context, kind, drawing)


def _suit(views: PatinaViews, subject: Subject) -> None:
    """The highlight curve where most samples are, until the artist chooses."""
    global _suiting
    best = most_measured(subject)
    if best is None:
        return
    _suiting = True
    try:
        views.theta_d = math.radians(best)
    finally:
        _suiting = False


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
        brdf = moved_brdf(material)
        return None if brdf is None else Subject("changed", brdf.evaluate)
    if views.against == MATERIAL:
        if views.other is None:
            raise PatinaError("no material chosen to compare with")
        return subject_of(views.other)
    if views.against == FILE:
        if not views.file:
            raise PatinaError("no file chosen to compare with")
        path = Path(bpy.path.abspath(views.file))
        return Subject(path.stem, merl_file.read(path).evaluate)
    return None


register, unregister = register_property_factory(bpy.types.Scene, "patina_views", PatinaViews)
