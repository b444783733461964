"""Register and unregister what several modules add to Blender: handlers and pointer properties."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import bpy

Handlers = Iterable[tuple[str, Callable[..., None]]]
"""Names of lists in bpy.app.handlers, and what each is to call."""
Registration = tuple[Callable[[], None], Callable[[], None]]
"""A module's functions (register, unregister)."""


def attach(handlers: Handlers) -> None:
    """Add the handlers to Blender's lists."""
    for name, handler in handlers:
        getattr(bpy.app.handlers, name).append(handler)


def detach(handlers: Handlers) -> None:
    """Remove the handlers from Blender's lists."""
    for name, handler in handlers:
        getattr(bpy.app.handlers, name).remove(handler)


def register_handlers_factory(handlers: Handlers) -> Registration:
    """(register, unregister) of a module that has handlers and nothing else to register."""
    return lambda: attach(handlers), lambda: detach(handlers)


def register_property_factory(
    owner: type[bpy.types.ID], name: str, *classes: type[bpy.types.PropertyGroup]
) -> Registration:
    """(register, unregister) of property groups, the last of which every ``owner`` gets as its
    pointer property ``name``."""
    register_classes, unregister_classes = bpy.utils.register_classes_factory(classes)

    def register() -> None:
        register_classes()
        setattr(owner, name, bpy.props.PointerProperty(type=classes[-1]))

    def unregister() -> None:
        delattr(owner, name)
        unregister_classes()

    return register, unregister
