"""Find photos that are copies of another one: each would count as a further observation, and a
held-out photo would be predicted from itself."""

from __future__ import annotations

import filecmp
import hashlib
from pathlib import Path

from ..capture import Capture
from ..files import open_regular, regular_size

PART_BYTES = 1 << 16  # of each part of a file that is compared before the whole


def check_different_photos(capture: Capture) -> None:
    """Raise InputError where a photo has the same bytes as another. Reads few bytes of each file,
    and only equal ones completely. Files that cannot be read are left to those that read them."""
    known: dict[tuple[int, bytes], list[tuple[int, Path]]] = {}
    for place, photo in enumerate(capture.photos):
        for file in photo.files:
            try:
                alike = known.setdefault(_part(file), [])
                for other, earlier in alike:
                    if filecmp.cmp(file, earlier, shallow=False):
                        raise capture.error(
                            f"{file.name!r} has the same content as {earlier.name!r} (photo "
                            f"{other + 1}); expected each photo once: remove one of the entries",
                            "photo", place, "file",
                        )  # fmt: skip
                alike.append((place, file))
            except OSError:
                continue


def _part(file: Path) -> tuple[int, bytes]:
    """Size, and a hash of the middle and the end, where photos differ: the headers of one camera
    are alike. Raises OSError."""
    size, digest = regular_size(file), hashlib.blake2b(digest_size=16)
    with open_regular(file) as content:
        for start in (size // 2, max(0, size - PART_BYTES)):
            content.seek(start)
            digest.update(content.read(PART_BYTES))
    return size, digest.digest()
