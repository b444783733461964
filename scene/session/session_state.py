"""Values that are kept in memory until another file is opened, and not stored in the .blend."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

import bpy

from .handlers import attach, detach

T = TypeVar("T")
_all: list[KeptValue[Any]] = []


class KeptValue(Generic[T]):
    """Holds one value or None."""

    def __init__(self) -> None:
        self.value: T | None = None
        _all.append(self)

    def forget(self) -> None:
        """Discard the value."""
        self.value = None


@bpy.app.handlers.persistent
def _forget(*_: object) -> None:
    """Discard all values before another file is loaded."""
    for kept in _all:
        kept.forget()


HANDLERS = (("load_pre", _forget),)


def register() -> None:
    """Add the handler for loading files."""
    attach(HANDLERS)


def unregister() -> None:
    """Remove the handler and discard all values."""
    detach(HANDLERS)
    _forget()
