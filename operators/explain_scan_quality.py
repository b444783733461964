"""Check stage: say what a figure of the scan's quality means."""

from __future__ import annotations

import bpy

from ..core.diagnose.assessment.scan_rating import RatedFigure, rated_figures
from ..core.fit.fit_quality import Rating
from ..scene.session.scene_properties import DIAGNOSIS, capture_path, stored_result


class PATINA_OT_explain_scan_quality(bpy.types.Operator):
    """Say what this figure of the scan means, and what to do where it is not good"""

    bl_idname = "patina.explain_scan_quality"
    bl_label = "Explain Scan Quality"
    bl_options = {"INTERNAL"}

    figure: bpy.props.StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]

    @classmethod
    def description(cls, context: bpy.types.Context, properties: object) -> str:
        figure = _figure(context, properties.figure)
        return cls.__doc__ if figure is None else _text(figure)

    def execute(self, context: bpy.types.Context) -> set[str]:
        figure = _figure(context, self.figure)
        if figure is None:
            self.report({"ERROR"}, "This capture has no check; run Check first")
            return {"CANCELLED"}
        self.report({"INFO"}, _text(figure))
        return {"FINISHED"}


def _figure(context: bpy.types.Context, label: str) -> RatedFigure | None:
    """The figure of that name in the last check."""
    quality = (stored_result(capture_path(context.scene), DIAGNOSIS) or {}).get("scan_quality")
    figures = [] if quality is None else rated_figures(quality)
    return next((figure for figure in figures if figure.label == label), None)


def _text(figure: RatedFigure) -> str:
    text = f"{figure.label} {figure.value} ({figure.rating.value}): {figure.meaning}"
    return text if figure.rating is Rating.GOOD else f"{text}. {figure.remedy}"


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_explain_scan_quality,))
