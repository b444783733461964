"""Stepped work: generators that yield progress and return a result."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, TypeVar

Step = TypeVar("Step")
Other = TypeVar("Other")
Result = TypeVar("Result")


def relayed(
    steps: Generator[Step, None, Result], convert: Callable[[Step], Other]
) -> Generator[Other, None, Result]:
    """The same work, with ``convert`` applied to each step that it yields."""
    while True:
        try:
            step = next(steps)
        except StopIteration as end:
            return end.value
        yield convert(step)


def scaled(
    steps: Generator[float, None, Result], start: float, end: float
) -> Generator[float, None, Result]:
    """The same work, its fractions done placed between ``start`` and ``end``."""
    return relayed(steps, lambda done: start + (end - start) * done)


def drained(steps: Generator[Any, None, Result]) -> Result:
    """Run stepped work to its end and return its result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
