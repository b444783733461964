"""Names of photos in sentences that number them."""

from __future__ import annotations

import re
from collections.abc import Sequence

NUMBERED_PHOTO = re.compile(r"\bphoto (\d+)\b")


def with_photo_names(sentence: str, names: Sequence[str]) -> str:
    """The sentence with the name of a photo after each number, which counts from 1. Numbers without
    a name stay as they are."""

    def named(found: re.Match[str]) -> str:
        number = int(found[1])
        known = 1 <= number <= len(names)
        return f"{found[0]} ({names[number - 1]})" if known else found[0]

    return NUMBERED_PHOTO.sub(named, sentence)
