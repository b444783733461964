"""A user's mistake as a message in Blender, never a traceback."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ..core.errors import PatinaError


def refuse(operator: bpy.types.Operator, error: PatinaError) -> set[str]:
    """Report an error and cancel."""
    operator.report({"ERROR"}, str(error))
    return {"CANCELLED"}


def hand_on(
    operator: bpy.types.Operator, following: Callable[..., set[str]], way: str, **told: Any
) -> set[str]:
    """Call another operator, as bpy.ops has it; what that one refuses is this one's message."""
    try:
        return following(way, **told)
    except RuntimeError as error:
        said = str(error).strip().removeprefix("Error: ")
        operator.report({"ERROR"}, said)
        return {"CANCELLED"}
