"""Work that is stepped: a generator yields as it goes on and returns what it made."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, TypeVar

Result = TypeVar("Result")


def drained(steps: Generator[Any, None, Result]) -> Result:
    """What a stepped piece of work returns, all of it at once."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
