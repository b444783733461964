"""A user's mistake as a message in Blender, never a traceback."""

from __future__ import annotations

import bpy

from ..core.errors import PatinaError


def refuse(operator: bpy.types.Operator, error: PatinaError) -> set[str]:
    """Report an error and cancel."""
    operator.report({"ERROR"}, str(error))
    return {"CANCELLED"}
