"""Factories of register and unregister functions for handlers and pointer properties."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import bpy

Handlers = Iterable[tuple[str, Callable[..., None]]]
"""(name of a list in bpy.app.handlers, function to add to it) for each handler."""
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
    """(register, unregister) of a module that registers only handlers."""
    return lambda: attach(handlers), lambda: detach(handlers)


def register_property_factory(
    owner: type[bpy.types.ID], name: str, *classes: type[bpy.types.PropertyGroup]
) -> Registration:
    """(register, unregister) of property groups; the last one becomes the pointer property ``name``
    of ``owner``."""
    register_classes, unregister_classes = bpy.utils.register_classes_factory(classes)

    def register() -> None:
        register_classes()
        setattr(owner, name, bpy.props.PointerProperty(type=classes[-1]))

    def unregister() -> None:
        delattr(owner, name)
        unregister_classes()

    return register, unregister
