"""What a check found, best first."""

from __future__ import annotations

from typing import Any

import bpy

from ..scene.evidence import MISSED
from .wrapped import wrapped

MOST = 6


def draw_check(layout: bpy.types.UILayout, diagnosis: dict[str, Any]) -> None:
    """diagnosis: the content of diagnosis.json."""
    named = [c for c in diagnosis["named"] if c != "none"]
    text = ", ".join(n.replace("_", " ") for n in named) or "Nothing that can be named"
    layout.label(text=text, icon="ERROR" if named else "CHECKMARK")
    before, after = diagnosis["baseline"]["not_noise"], diagnosis["extended"]["not_noise"]
    layout.label(text=f"Not noise: {100 * before:.0f} % of what is missed")
    if named:
        layout.label(text=f"… with these causes: {100 * after:.0f} %", icon="BLANK1")
    show = layout.operator("patina.show_evidence", text="What is Missed", icon="OVERLAY")
    show.cause = MISSED
    causes = diagnosis["causes"]
    most = max((_sure(c) for c in causes), default=1.0)
    for cause in causes[:MOST]:
        box = layout.box()
        row = box.row()
        name = cause["cause"].replace("_", " ")
        row.progress(text=name, factor=min(max(_sure(cause) / max(most, 1e-9), 0), 1), type="BAR")
        if cause["accepted"]:
            row.operator("patina.show_evidence", text="", icon="HIDE_OFF").cause = cause["cause"]
            wrapped(box, cause["sentence"], "BLANK1")
    if diagnosis["left"]["named"]:
        wrapped(layout, diagnosis["left"]["sentence"], "QUESTION")


def _sure(cause: dict[str, Any]) -> float:
    """The gain in standard errors."""
    return float(cause["held_out_gain"] / max(cause["standard_error"], 1e-9))
