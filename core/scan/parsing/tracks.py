"""Read points with the list of photos that observe them, as Bundler and VisualSFM write them: a
sequence of numbers whose length depends on each point's count of observations."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .json_record import MAX_MAGNITUDE
from .number_stream import NumberStream

Array = NDArray[np.float64]

MAX_KEPT = 200_000  # observations kept, to compare lens models
VALUES_PER_POINT = 7  # before the list: position (3), colour (3), count
MAX_POINT_OBSERVATIONS = 1 << 20  # more are rejected
VALUES_PER_OBSERVATION = 4  # photo, feature, x, y


@dataclass
class Tracks:
    """The points read so far.

    points, colours: pieces (n, 3). least, most: (cameras, 2) extent of the observations of each
    camera, pixels as written. kept: (n, 6) some observations: camera, x, y, position of the point.
    """

    cameras: int
    points: list[Array] = field(default_factory=list)
    colours: list[Array] = field(default_factory=list)
    kept: list[Array] = field(default_factory=list)
    kept_count: int = 0
    least: Array = field(init=False)
    most: Array = field(init=False)

    def __post_init__(self) -> None:
        self.least = np.full((self.cameras, 2), np.inf)
        self.most = np.full((self.cameras, 2), -np.inf)

    def add(self, values: Array, limit: int, stream: NumberStream) -> tuple[int, int]:
        """(numbers used, points found) of the complete records at the start of ``values``, at most
        ``limit`` records. Raises InputError."""
        starts: list[int] = []
        at, end, item = 0, len(values), values.item
        while len(starts) < limit and at + VALUES_PER_POINT <= end:
            count = item(at + VALUES_PER_POINT - 1)
            if not (0 <= count < MAX_POINT_OBSERVATIONS and count == int(count)):
                raise stream.error(
                    f"has a point with {count:g} observations, on this line or above"
                )
            record_end = at + VALUES_PER_POINT + VALUES_PER_OBSERVATION * int(count)
            if record_end > end:
                break
            starts.append(at)
            at = record_end
        if starts:
            self._gather(values, np.array(starts), stream)
        return at, len(starts)

    def _gather(self, values: Array, starts: NDArray[np.int64], stream: NumberStream) -> None:
        head = values[starts[:, None] + np.arange(6)]
        self.points.append(head[:, :3])
        self.colours.append(head[:, 3:])
        counts = values[starts + VALUES_PER_POINT - 1].astype(np.int64)
        of_point = np.repeat(np.arange(len(starts)), counts)
        within = np.arange(len(of_point)) - np.repeat(np.cumsum(counts) - counts, counts)
        seen = values[
            (starts[of_point] + VALUES_PER_POINT + VALUES_PER_OBSERVATION * within)[:, None]
            + (0, 2, 3)
        ]
        with np.errstate(invalid="ignore"):
            known = (seen[:, 0] >= 0) & (seen[:, 0] < self.cameras)
        if not known.all():
            raise stream.error(
                f"has an observation of photo {seen[~known][0, 0]:g}, on this line or above; "
                f"expected a number below {self.cameras}"
            )
        with np.errstate(invalid="ignore"):
            sane = np.abs(np.c_[seen, head[of_point, :3]]) < MAX_MAGNITUDE
        good = sane.all(axis=1)
        seen, of_point = seen[good], of_point[good]
        camera = seen[:, 0].astype(np.int64)
        np.minimum.at(self.least, camera, seen[:, 1:])
        np.maximum.at(self.most, camera, seen[:, 1:])
        capacity = MAX_KEPT - self.kept_count
        if capacity > 0:
            self.kept.append(np.c_[seen, head[of_point, :3]][:capacity])
            self.kept_count += min(capacity, len(seen))

    def observations(self) -> Array:
        """(n, 6) the kept observations."""
        return np.concatenate(self.kept) if self.kept else np.zeros((0, 6))

    def all_points(self) -> tuple[Array, Array]:
        """(points, colours), (n, 3) each."""
        if not self.points:
            return np.zeros((0, 3)), np.zeros((0, 3))
        return np.concatenate(self.points), np.concatenate(self.colours)
