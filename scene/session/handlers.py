"""Functions that Blender calls when something happens, added and taken away in one place."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import bpy

Handlers = Iterable[tuple[str, Callable[..., None]]]
"""Names of lists in bpy.app.handlers, and what each is to call."""


def attach(handlers: Handlers) -> None:
    """From now on."""
    for name, handler in handlers:
        getattr(bpy.app.handlers, name).append(handler)


def detach(handlers: Handlers) -> None:
    """No more."""
    for name, handler in handlers:
        getattr(bpy.app.handlers, name).remove(handler)
