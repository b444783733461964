"""What is kept while Blender runs, and let go when another file is opened: no .blend holds it."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

import bpy

from .handlers import attach, detach

T = TypeVar("T")
_all: list[Kept[Any]] = []


class Kept(Generic[T]):
    """One thing or none."""

    def __init__(self) -> None:
        self.thing: T | None = None
        _all.append(self)

    def forget(self) -> None:
        """Let it go."""
        self.thing = None


@bpy.app.handlers.persistent
def _forget(*_: object) -> None:
    """Another file is opened."""
    for one in _all:
        one.forget()


HANDLERS = (("load_pre", _forget),)


def register() -> None:
    """Watch for another file."""
    attach(HANDLERS)


def unregister() -> None:
    """No more, and forget everything."""
    detach(HANDLERS)
    _forget()
