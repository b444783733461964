"""Work that is stepped: a generator yields as it goes on and returns what it made."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, TypeVar

Step = TypeVar("Step")
Other = TypeVar("Other")
Result = TypeVar("Result")


def relayed(
    steps: Generator[Step, None, Result], said: Callable[[Step], Other]
) -> Generator[Other, None, Result]:
    """The same work, which yields what ``said`` makes of each step."""
    while True:
        try:
            step = next(steps)
        except StopIteration as end:
            return end.value
        yield said(step)


def drained(steps: Generator[Any, None, Result]) -> Result:
    """What a stepped piece of work returns, all of it at once."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
