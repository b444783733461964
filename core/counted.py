"""Counts and lists in sentences: "1 photo", "2 photos"; "a, b, c …"."""

from __future__ import annotations

from collections.abc import Sequence

MAX_LISTED = 3  # names in a sentence


def counted(count: int, singular: str, plural: str = "") -> str:
    """The count with its noun. plural: for nouns that do not only get an "s"."""
    return f"{count:,} {singular if count == 1 else plural or singular + 's'}"


def listed(names: Sequence[str]) -> str:
    """The first few of the names, and an ellipsis if there are more."""
    return ", ".join(names[:MAX_LISTED]) + (" …" if len(names) > MAX_LISTED else "")
