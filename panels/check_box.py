"""What a check found, best first."""

from __future__ import annotations

from typing import Any

import bpy

from ..scene.session.lengths import with_lengths
from ..scene.views.evidence import MISSED
from .wrapped import IN_BOX, wrapped

MOST = 6


def draw_check(
    layout: bpy.types.UILayout,
    diagnosis: dict[str, Any],
    causes: bpy.types.bpy_prop_collection,
) -> None:
    """diagnosis: the content of diagnosis.json; causes: PatinaCause, what can be switched off."""
    base, extended = diagnosis["baseline"], diagnosis["extended"]
    told = [("Left-out parts, RMS", base["held_out"], extended["held_out"])]
    for one in diagnosis["materials"]:  # of a file that an earlier version checked: no typical ones
        told.append((one["name"], one.get("typical_before"), one.get("typical_after")))
    for place, (label, before, after) in enumerate(told):
        if before is not None and after is not None:
            if place == 1:
                layout.label(text="Unseen photos, typical pixel:")
            row = layout.row()
            row.label(text=label, icon="MATERIAL" if place else "NONE")
            row.label(text=f"{100 * before:.1f} → {100 * after:.1f} %")
    show = layout.operator("patina.show_evidence", text="What is Missed", icon="OVERLAY")
    show.cause = MISSED
    ranked = diagnosis["causes"]
    most = max((_sure(c) for c in ranked), default=1.0)
    for cause in ranked[:MOST]:
        box = layout.box()
        row = box.row()
        name = cause["cause"].replace("_", " ")
        switch = causes.get(cause["cause"])
        if switch is not None and cause["accepted"]:
            row.prop(switch, "use", text="")
        bar = row.row()
        bar.active = cause["accepted"] and not cause.get("doubted")  # else grey, as in the report
        bar.progress(text=name, factor=min(max(_sure(cause) / max(most, 1e-9), 0), 1), type="BAR")
        if cause["accepted"]:
            row.operator("patina.show_evidence", text="", icon="HIDE_OFF").cause = cause["cause"]
        if cause["accepted"] or cause.get("doubted"):
            wrapped(box, with_lengths(cause["sentence"]), "BLANK1", IN_BOX)
    if len(causes):
        used = {cause.name for cause in causes if cause.use}
        changed = used != set(diagnosis["applied"])
        row = layout.row()
        row.alert = changed
        row.operator("patina.refit", icon="FILE_REFRESH" if changed else "CHECKMARK")
    if diagnosis["unexplained"]:
        wrapped(layout, with_lengths(diagnosis["left"]["sentence"]), "QUESTION")


def _sure(cause: dict[str, Any]) -> float:
    """The gain in standard errors."""
    return float(cause["held_out_gain"] / max(cause["standard_error"], 1e-9))
