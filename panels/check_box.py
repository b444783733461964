"""Draw the results of a check: errors before and after, and the causes by significance."""

from __future__ import annotations

from typing import Any

import bpy

from ..core.diagnose.assessment.scan_rating import rated_figures
from ..core.diagnose.effects.labels import ORIGINS, cause_label, origin_of
from ..core.fit.fit_quality import Rating
from ..scene.scan.evidence_colours import RESIDUAL
from ..scene.session.lengths import with_lengths
from ..scene.session.overlay_shading import overlay_shown
from .wrapped import IN_BOX, wrapped

HEADINGS = ("Held-out regions, RMS error:", "Held-out photos, median error:")
# Blender 4.4 renamed the icons; green, yellow and red squares
COLOUR_ICON = "STRIP_COLOR_0" if bpy.app.version >= (4, 4) else "SEQUENCE_COLOR_0"
RATING_ICONS = {
    Rating.GOOD: f"{COLOUR_ICON}4",
    Rating.FAIR: f"{COLOUR_ICON}3",
    Rating.POOR: f"{COLOUR_ICON}1",
}
MAX_CAUSES = 8  # causes without effect that the panel lists


def draw_check(
    layout: bpy.types.UILayout,
    diagnosis: dict[str, Any],
    causes: bpy.types.bpy_prop_collection,
) -> None:
    """Draw a diagnosis.

    diagnosis: the content of diagnosis.json; causes: the PatinaCause items that the user can
    switch off.
    """
    base, extended = diagnosis["baseline"], diagnosis["extended"]
    errors = [("All materials", base["held_out"], extended["held_out"])]
    for material in diagnosis["materials"]:  # diagnoses by earlier versions have no typical errors
        errors.append(
            (material["name"], material.get("typical_before"), material.get("typical_after"))
        )
    for index, (label, before, after) in enumerate(errors):
        if before is not None and after is not None:
            if index < len(HEADINGS):
                layout.label(text=HEADINGS[index])
            row = layout.row()
            row.label(text=label, icon="MATERIAL" if index else "NONE")
            row.label(text=f"{100 * before:.1f} → {100 * after:.1f} %")
    shown = overlay_shown()
    layout.operator(
        "patina.show_evidence",
        text="Show Residual",
        icon="OVERLAY",
        depress=shown == RESIDUAL,
    ).cause = RESIDUAL
    ranked = diagnosis["causes"]
    largest = max((_significance(c) for c in ranked), default=1.0)
    reported = [c for c in ranked if c["accepted"] or c.get("contradicted")]
    for origin in (*ORIGINS, "Other"):
        mine = [c for c in reported if origin_of(c["cause"]) == origin]
        if mine:
            layout.label(text=origin)
        for cause in mine:
            _draw_cause(layout, cause, causes, largest, shown)
    others = [c for c in ranked if c not in reported]
    if others:
        header, body = layout.panel("patina_causes_without_effect", default_closed=True)
        header.label(text="Also Tested, Not Accepted")
        for cause in others[:MAX_CAUSES] if body is not None else ():
            _draw_cause(body, cause, causes, largest, shown)
    if len(causes):
        used = {cause.name for cause in causes if cause.use}
        changed = used != set(diagnosis["applied"])
        row = layout.row()
        row.alert = changed
        row.operator("patina.refit", icon="FILE_REFRESH" if changed else "CHECKMARK")
    if "scan_quality" in diagnosis:  # not in results of earlier versions
        _draw_scan_quality(layout, diagnosis["scan_quality"])
    if diagnosis["unexplained"]:
        wrapped(layout, with_lengths(diagnosis["left"]["sentence"]), "QUESTION")


def _draw_scan_quality(layout: bpy.types.UILayout, quality: dict[str, Any]) -> None:
    """Draw the figures of the scan, each with a colour; the tooltip of a figure says what to do."""
    layout.label(text="Scan Quality")
    for figure in rated_figures(quality):
        row = layout.row()
        row.label(text=figure.label, icon=RATING_ICONS[figure.rating])
        shown = row.operator("patina.explain_scan_quality", text=figure.value, translate=False)
        shown.figure = figure.label


def _draw_cause(
    layout: bpy.types.UILayout,
    cause: dict[str, Any],
    causes: bpy.types.bpy_prop_collection,
    largest: float,
    shown: str,
) -> None:
    """Draw one cause. largest: significance of the first one; shown: cause of the overlay."""
    box = layout.box()
    row = box.row()
    switch = causes.get(cause["cause"])
    if switch is not None and cause["accepted"]:
        row.prop(switch, "use", text="")
    bar = row.row()
    # greyed out otherwise, as in the report
    bar.active = cause["accepted"] and not cause.get("contradicted")
    factor = min(max(_significance(cause) / max(largest, 1e-9), 0), 1)
    bar.progress(text=cause_label(cause["cause"]), factor=factor, type="BAR")
    if cause["accepted"]:
        row.operator(
            "patina.show_evidence",
            text="",
            icon="HIDE_OFF",
            depress=shown == cause["cause"],
        ).cause = cause["cause"]
    if cause["accepted"] or cause.get("contradicted"):
        wrapped(box, with_lengths(cause["sentence"]), "BLANK1", IN_BOX)
    if bar.active and "action" in cause:  # not in results of earlier versions
        wrapped(box, cause["action"], "FORWARD", IN_BOX)


def _significance(cause: dict[str, Any]) -> float:
    """The reduction of the held-out error, in standard errors of that reduction."""
    return float(cause["held_out_gain"] / max(cause["standard_error"], 1e-9))
