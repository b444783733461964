"""Sentences that number photos name them too."""

from __future__ import annotations

from patina.core.photo_names import with_photo_names


def test_numbered_photos_are_named() -> None:
    names = [f"view_{k}.jpg" for k in range(12)]
    sentence = "Photo 1 of 12: photo 3 is 13 % brighter than photo 12, and photo 99 is unknown."
    assert with_photo_names(sentence, names) == (
        "Photo 1 of 12: photo 3 (view_2.jpg) is 13 % brighter than photo 12 (view_11.jpg), and "
        "photo 99 is unknown."
    )


def test_nothing_is_named_without_names() -> None:
    assert with_photo_names("in photo 2.", []) == "in photo 2."
