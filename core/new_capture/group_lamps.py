"""Group photos by the lamp that lit them: by folder, by name, by time, or by their shading."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import datetime
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

LAMP_IN_NAME = re.compile(
    r"(?:^|[_\-. ])(?:lamp|light|led|l)[_\-. ]?([0-9]{1,3}|[a-h])(?=$|[_\-. ])"
)
MIN_GAP = 60.0  # seconds between photos of two lamps, and
MIN_GAP_RATIO = 5.0  # times the median gap: moving a lamp takes longer than the next photo
SAME_DIRECTION = np.cos(np.radians(5.0))  # a lamp split in two costs less than two lamps in one


def by_folder_or_name(photos: Sequence[Path]) -> list[int] | None:
    """Index of each photo's lamp, where folders or names (lamp2_007, 007-L3) separate them."""
    folders = list(dict.fromkeys(photo.parent for photo in photos))
    if 1 < len(folders) < len(photos):
        return [folders.index(photo.parent) for photo in photos]
    found = [LAMP_IN_NAME.search(photo.stem.lower()) for photo in photos]
    words = [match.group(1) if match else None for match in found]
    names = list(dict.fromkeys(words))
    if None in names or len(names) < 2:
        return None
    return [names.index(word) for word in words]


def by_time(photos: Sequence[Path], times: Mapping[Path, datetime | None]) -> list[int] | None:
    """Index of each photo's lamp, where pauses between the photos separate them."""
    known = [(time, i) for i, photo in enumerate(photos) if (time := times.get(photo)) is not None]
    if len(known) < len(photos) or len(photos) < 3:
        return None
    known.sort()
    gaps = np.array([(b[0] - a[0]).total_seconds() for a, b in pairwise(known)])
    pause = max(MIN_GAP, MIN_GAP_RATIO * float(np.median(gaps)))
    lamps, lamp = [0] * len(photos), 0
    for (_, index), gap in zip(known[1:], gaps, strict=True):
        lamp += bool(gap > pause)
        lamps[index] = lamp
    return lamps if lamp else None


def by_direction(directions: Sequence[NDArray[np.float64]]) -> list[int]:
    """Index of each photo's lamp: photos whose light comes from the same direction share it.

    directions: (3,) surface → light of each photo, in one frame.
    """
    centres: list[NDArray[np.float64]] = []
    lamps = []
    for direction in directions:
        cosines = [float(direction @ c / np.linalg.norm(c)) for c in centres]
        if cosines and max(cosines) > SAME_DIRECTION:
            lamp = int(np.argmax(cosines))
            centres[lamp] = centres[lamp] + direction
        else:
            lamp = len(centres)
            centres.append(direction.copy())
        lamps.append(lamp)
    return lamps
