"""Counts in sentences: "1 photo", "2 photos"."""

from __future__ import annotations


def counted(count: int, singular: str, plural: str = "") -> str:
    """The count with its noun. plural: for nouns that do not only get an "s"."""
    return f"{count:,} {singular if count == 1 else plural or singular + 's'}"
