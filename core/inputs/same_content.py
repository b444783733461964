"""Find photos that are copies of another one: each would count as a further observation, and a
held-out photo would be predicted from itself."""

from __future__ import annotations

import filecmp
import hashlib
from pathlib import Path

from ..capture import Capture
from ..counted import listed
from ..files import open_regular, regular_size

PART_BYTES = 1 << 16  # of each part of a file that is compared before the whole


def copied_photos(capture: Capture) -> list[str]:
    """A sentence on photos with the same bytes as another, none where there are no such. Reads few
    bytes of each file, and only equal ones completely. Files that cannot be read are left to those
    that read them."""
    known: dict[tuple[int, bytes], list[Path]] = {}
    found = []
    for photo in capture.photos:
        for file in photo.files:
            try:
                alike = known.setdefault(_part(file), [])
                first = next((f for f in alike if filecmp.cmp(file, f, shallow=False)), None)
            except OSError:
                continue
            if first is None:
                alike.append(file)
            else:
                found.append(f"{_shown(file, capture)} of {_shown(first, capture)}")
    if not found:
        return []
    return [
        f"Photos with the same content as others: {listed(found)}. They count twice, and held-out "
        "photos are predicted from their own copies, so that errors are too small. Remove copies "
        "from the capture."
    ]


def _shown(file: Path, capture: Capture) -> str:
    """The path relative to the capture's folder, where it is in it."""
    folder = capture.file.parent
    return (file.relative_to(folder) if file.is_relative_to(folder) else file).as_posix()


def _part(file: Path) -> tuple[int, bytes]:
    """Size, and a hash of the middle and the end, where photos differ: the headers of one camera
    are alike. Raises OSError."""
    size, digest = regular_size(file), hashlib.blake2b(digest_size=16)
    with open_regular(file) as content:
        for start in (size // 2, max(0, size - PART_BYTES)):
            content.seek(start)
            digest.update(content.read(PART_BYTES))
    return size, digest.digest()
