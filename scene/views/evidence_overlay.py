"""Show the evidence of a check, or how the materials vary, on the mesh, with a legend in the
viewport, until it is left."""

from __future__ import annotations

from typing import Any

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ...core.diagnose.effects.labels import cause_label
from ...core.views.surface_view import QUANTITIES
from ..property_keys import EVIDENCE_COLOURS, VARIATION_COLOURS
from ..scan.evidence_colours import FULL_SCALE, RESIDUAL
from ..scan.vertex_colours import UNOBSERVED, colours_of
from ..session.handlers import attach, detach
from ..session.overlay_shading import (
    enter_overlay,
    leave_overlay,
    overlay_shown,
    overlay_undone,
    shows_overlay,
)

LEFT, BOTTOM, WIDTH, HEIGHT, TEXT, GAP = 24, 40, 280, 14, 12, 6  # pixels at a display scale of 1
STEPS = 24  # coloured rectangles of the scale
_handle: Any = None


def toggle_evidence(mesh: bpy.types.Object, cause: str) -> bool | None:
    """Show the evidence of a cause; leave it if it is shown already. Returns whether it is shown
    now, None if the mesh has no colours for the cause."""
    return _toggle(mesh, cause, EVIDENCE_COLOURS + cause)


def toggle_variation(mesh: bpy.types.Object, kind: str) -> bool | None:
    """The same for a kind of variation."""
    return _toggle(mesh, VARIATION_COLOURS + kind, VARIATION_COLOURS + kind)


def _toggle(mesh: bpy.types.Object, shown: str, attribute: str) -> bool | None:
    """shown: identifier of what the overlay shows; attribute: name of its colours."""
    if overlay_shown() == shown:
        leave_overlay()
        return False
    if attribute not in mesh.data.color_attributes:
        return None
    enter_overlay(shown, mesh)
    attributes = mesh.data.color_attributes  # Solid shading shows the active one
    attributes.active_color = attributes[attribute]
    return True


def legend(shown: str) -> tuple[str, tuple[str, str, str]]:
    """(title, labels of the left end, the middle and the right end) of the colour scale."""
    percent = f"{100 * FULL_SCALE:.0f} %"
    if shown.startswith(VARIATION_COLOURS):
        quantity = QUANTITIES[shown.removeprefix(VARIATION_COLOURS)]
        return quantity.title, quantity.ends
    if shown == RESIDUAL:
        title = "Residual: photos compared with prediction"
        return title, (f"{percent} darker", "equal", f"{percent} brighter")
    title = f"{cause_label(shown)}: change of the photos"
    return title, (f"{percent} darker", "none", f"{percent} brighter")


def scale_colours(shown: str, count: int = STEPS) -> np.ndarray:
    """(count, 3) sRGB colours of the scale from its left end to its right end."""
    signed = not shown.startswith(VARIATION_COLOURS)
    signed = signed or QUANTITIES[shown.removeprefix(VARIATION_COLOURS)].signed
    return colours_of(np.linspace(-1 if signed else 0, 1, count))


def _draw() -> None:
    """Draw the legend into a viewport that shows the overlay."""
    context = bpy.context
    shown = overlay_shown(context.screen) if context.screen else ""
    if not shown or context.area is None or not shows_overlay(context.area):
        return
    scale = context.preferences.system.ui_scale
    left = LEFT * scale + _tool_width(context.area)
    low, width, height = BOTTOM * scale, WIDTH * scale, HEIGHT * scale
    title, (dark, middle, bright) = legend(shown)
    line = (TEXT + GAP) * scale
    margin = GAP * scale
    _rectangle(
        left - margin, low - line - margin, width + 2 * margin, height + 2 * line + 4 * margin,
        (0.0, 0.0, 0.0, 0.6),
    )  # fmt: skip
    step = width / STEPS
    for index, colour in enumerate(scale_colours(shown)):
        _rectangle(left + index * step, low, step + 1, height, (*colour, 1.0))
    _text(left, low + height + margin, title, scale)
    _text(left, low - line + margin / 2, dark, scale)
    _text(left + width / 2, low - line + margin / 2, middle, scale, 0.5)
    _text(left + width, low - line + margin / 2, bright, scale, 1.0)
    grey = low + height + line + margin / 2
    _rectangle(left, grey, height, height * 0.8, (*UNOBSERVED, 1.0))
    missing = (
        "in no lit photo" if shown.startswith(VARIATION_COLOURS) else "seen by no sampled pixel"
    )
    _text(left + height + margin, grey, missing, scale)


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
