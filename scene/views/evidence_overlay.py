"""Show the evidence of a check on the mesh, with a legend in the viewport, until it is left."""

from __future__ import annotations

from typing import Any

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ...core.diagnose.effects.labels import cause_label
from ..property_keys import EVIDENCE_COLOURS
from ..session.handlers import attach, detach
from ..session.overlay_shading import (
    enter_overlay,
    leave_overlay,
    overlay_shown,
    overlay_undone,
    shows_overlay,
)
from .evidence import BRIGHTER, DARKER, FULL_SCALE, RESIDUAL, SAME, UNOBSERVED, show_evidence

LEFT, BOTTOM, WIDTH, HEIGHT, TEXT, GAP = 24, 40, 280, 14, 12, 6  # pixels at a display scale of 1
STEPS = 24  # coloured rectangles of the scale
_handle: Any = None


def toggle_evidence(mesh: bpy.types.Object, cause: str) -> bool | None:
    """Show the evidence of a cause; leave it if it is shown already. Returns whether it is shown
    now, None if the mesh has no colours for the cause."""
    if overlay_shown() == cause:
        leave_overlay()
        return False
    if mesh.data.color_attributes.get(EVIDENCE_COLOURS + cause) is None:
        return None
    enter_overlay(cause, mesh)
    show_evidence(mesh, cause)
    return True


def legend(cause: str) -> tuple[str, tuple[str, str, str]]:
    """(title, labels of the left end, the middle and the right end) of the colour scale."""
    percent = f"{100 * FULL_SCALE:.0f} %"
    if cause == RESIDUAL:
        title = "Residual: photos compared with prediction"
        return title, (f"{percent} darker", "equal", f"{percent} brighter")
    title = f"{cause_label(cause)}: change of the photos"
    return title, (f"{percent} darker", "none", f"{percent} brighter")


def scale_colours(count: int = STEPS) -> np.ndarray:
    """(count, 3) sRGB colours of the scale from the darkest to the brightest."""
    part = np.linspace(-1, 1, count)[:, None]
    return SAME + (np.where(part < 0, DARKER, BRIGHTER) - SAME) * np.abs(part)


def _draw() -> None:
    """Draw the legend into a viewport that shows evidence."""
    context = bpy.context
    cause = overlay_shown(context.screen) if context.screen else ""
    if not cause or context.area is None or not shows_overlay(context.area):
        return
    scale = context.preferences.system.ui_scale
    left = LEFT * scale + _tool_width(context.area)
    low, width, height = BOTTOM * scale, WIDTH * scale, HEIGHT * scale
    title, (dark, middle, bright) = legend(cause)
    line = (TEXT + GAP) * scale
    margin = GAP * scale
    _rectangle(
        left - margin, low - line - margin, width + 2 * margin, height + 2 * line + 4 * margin,
        (0.0, 0.0, 0.0, 0.6),
    )  # fmt: skip
    step = width / STEPS
    for index, colour in enumerate(scale_colours()):
        _rectangle(left + index * step, low, step + 1, height, (*colour, 1.0))
    _text(left, low + height + margin, title, scale)
    _text(left, low - line + margin / 2, dark, scale)
    _text(left + width / 2, low - line + margin / 2, middle, scale, 0.5)
    _text(left + width, low - line + margin / 2, bright, scale, 1.0)
    grey = low + height + line + margin / 2
    _rectangle(left, grey, height, height * 0.8, (*UNOBSERVED, 1.0))
    _text(left + height + margin, grey, "seen by no sampled pixel", scale)


def _tool_width(area: bpy.types.Area) -> int:
    """Width of the toolbar, which overlaps the viewport."""
    return next((r.width for r in area.regions if r.type == "TOOLS" and r.width > 1), 0)


def _rectangle(x: float, y: float, width: float, height: float, colour: tuple[float, ...]) -> None:
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]
    batch = batch_for_shader(shader, "TRIS", {"pos": corners}, indices=[(0, 1, 2), (0, 2, 3)])
    gpu.state.blend_set("ALPHA")
    shader.uniform_float("color", colour)
    batch.draw(shader)
    gpu.state.blend_set("NONE")


def _text(x: float, y: float, text: str, scale: float, align: float = 0.0) -> None:
    """Draw a line of text. align: share of its width that lies to the left of ``x``."""
    blf.size(0, TEXT * scale)
    blf.color(0, 1.0, 1.0, 1.0, 1.0)
    blf.position(0, x - align * blf.dimensions(0, text)[0], y, 0)
    blf.draw(0, text)


@bpy.app.handlers.persistent
def _check(*_: object) -> None:
    """Leave the overlay where undo, redo or another file has taken its colours away."""
    if overlay_undone():
        leave_overlay()


HANDLERS = (("undo_post", _check), ("redo_post", _check), ("load_post", _check))


def register() -> None:
    """Add the handlers, and the legend to all 3D viewports."""
    global _handle
    attach(HANDLERS)
    _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_PIXEL")


def unregister() -> None:
    """Remove the handlers and the legend, and restore the shading."""
    global _handle
    detach(HANDLERS)
    if _handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
        _handle = None
    leave_overlay()
