"""Report a user's mistake as a message in Blender instead of a traceback."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ..core.errors import PatinaError


def report_and_cancel(operator: bpy.types.Operator, error: PatinaError) -> set[str]:
    """Report an error; returns {"CANCELLED"} for the operator to return."""
    operator.report({"ERROR"}, str(error))
    return {"CANCELLED"}


def call_operator(
    operator: bpy.types.Operator, following: Callable[..., set[str]], way: str, **properties: Any
) -> set[str]:
    """Call another operator; its error becomes the error of this one.

    following: the function in bpy.ops; way: the execution context ("EXEC_DEFAULT",
    "INVOKE_DEFAULT"); the keyword arguments are its properties. Returns the operator's result.
    """
    try:
        return following(way, **properties)
    except RuntimeError as error:
        message = str(error).strip().removeprefix("Error: ")
        operator.report({"ERROR"}, message)
        return {"CANCELLED"}
