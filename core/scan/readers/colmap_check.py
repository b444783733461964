"""Check a binary COLMAP model before pycolmap reads it: each count must fit into the remaining
bytes.

pycolmap trusts the counts in these files: a truncated file can make it loop for ever, allocate
gigabytes, or accept half a record as a whole one. This check takes milliseconds and allocates
nothing. Layouts as COLMAP 3.12 writes them; older models lack rigs.bin and frames.bin.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable
from functools import lru_cache
from pathlib import Path

import pycolmap

from ...errors import InputError

MAX_SIDE = 1 << 17  # pixels
MIN_RECORD_BYTES = {"camera": 24, "image": 73, "frame": 68, "rig": 8, "point": 51}


def check_binary_model(folder: Path) -> None:
    """Raise InputError naming the file that is truncated or whose values cannot be right."""
    cameras: set[int] = set()
    walks: tuple[tuple[str, Callable[[_Walk], None]], ...] = (
        ("cameras.bin", lambda walk: cameras.update(_cameras(walk))),
        ("images.bin", lambda walk: _images(walk, cameras)),
        ("rigs.bin", _rigs),
        ("frames.bin", _frames),
        ("points3D.bin", _points),
    )
    for name, step in walks:
        path = folder / name
        if not path.is_file():
            if name in ("rigs.bin", "frames.bin"):
                continue
            raise InputError("is missing from the COLMAP model", file=path)
        try:
            data = path.read_bytes()
        except OSError as error:
            raise InputError(f"cannot be read ({error.strerror})", file=path) from error
        walk = _Walk(data, path)
        step(walk)
        walk.end()


class _Walk:
    """A read position in the bytes of one file."""

    def __init__(self, data: bytes, path: Path) -> None:
        self.data, self.path, self.place = data, path, 0

    def error(self, message: str) -> InputError:
        return InputError(message, file=self.path)

    def take(self, layout: str) -> tuple:
        form = struct.Struct("<" + layout)
        if self.place + form.size > len(self.data):
            raise self.error(f"is truncated: it ends at byte {len(self.data)}, inside a record")
        values = form.unpack_from(self.data, self.place)
        self.place += form.size
        return values

    def skip(self, size: int) -> None:
        left = len(self.data) - self.place
        if size > left:
            raise self.error(f"is truncated: {size} bytes are declared, {left} remain")
        self.place += size

    def count(self, kind: str) -> int:
        (number,) = self.take("Q")
        if number * MIN_RECORD_BYTES[kind] > len(self.data) - self.place:
            raise self.error(
                f"declares {number} records, too many for its {len(self.data)} bytes: "
                "it is truncated or damaged"
            )
        return int(number)

    def end(self) -> None:
        if self.place != len(self.data):
            raise self.error(
                f"has {len(self.data) - self.place} bytes after the last record: it is damaged"
            )


@lru_cache(maxsize=1)
def _parameter_counts() -> dict[int, int]:
    """COLMAP's model number → number of lens parameters, as pycolmap defines them."""
    counts = {}
    for model in pycolmap.CameraModelId.__members__.values():
        if model != pycolmap.CameraModelId.INVALID:
            lens = pycolmap.Camera.create_from_model_id(1, model, 1.0, 9, 9)
            counts[int(model)] = len(lens.params)
    return counts


def _cameras(walk: _Walk) -> Iterable[int]:
    known = _parameter_counts()
    for _ in range(walk.count("camera")):
        number, model, width, height = walk.take("IiQQ")
        if model not in known:
            raise walk.error(
                f"camera {number} has the lens model {model}, which is not a COLMAP model"
            )
        if not (0 < width <= MAX_SIDE and 0 < height <= MAX_SIDE):
            raise walk.error(
                f"camera {number} has {width} × {height} pixels; expected a valid size"
            )
        if not all(map(math.isfinite, walk.take(f"{known[model]}d"))):
            raise walk.error(f"camera {number} has lens parameters that are not finite")
        yield number


def _images(walk: _Walk, cameras: set[int]) -> None:
    for _ in range(walk.count("image")):
        number, *pose, camera = walk.take("I7dI")
        if camera not in cameras:
            raise walk.error(
                f"image {number} refers to camera {camera}, which is not in cameras.bin"
            )
        _check_pose(walk, f"image {number}", pose)
        end = walk.data.find(b"\0", walk.place)
        if end < 0:
            raise walk.error("is truncated: the name of an image has no terminating zero")
        try:
            walk.data[walk.place : end].decode()
        except UnicodeDecodeError:
            raise walk.error(f"the name of image {number} is not UTF-8") from None
        walk.place = end + 1
        walk.skip(24 * walk.take("Q")[0])


def _frames(walk: _Walk) -> None:
    for _ in range(walk.count("frame")):
        number, _, *pose, data = walk.take("II7dI")
        _check_pose(walk, f"frame {number}", pose)
        walk.skip(16 * data)


def _rigs(walk: _Walk) -> None:
    for _ in range(walk.count("rig")):
        number, sensors = walk.take("II")
        if sensors > 0:
            walk.skip(8)
        for _ in range(max(sensors - 1, 0)):
            _, _, has_pose = walk.take("iIB")
            if has_pose:
                _check_pose(walk, f"a sensor of rig {number}", walk.take("7d"))


def _points(walk: _Walk) -> None:
    for _ in range(walk.count("point")):
        walk.skip(43)
        walk.skip(8 * walk.take("Q")[0])


def _check_pose(walk: _Walk, what: str, pose: Iterable[float]) -> None:
    values = list(pose)
    if not all(map(math.isfinite, values)):
        raise walk.error(f"the pose of {what} is not finite")
    length = math.sqrt(sum(q * q for q in values[:4]))
    if abs(length - 1) > 1e-3:
        raise walk.error(
            f"the rotation of {what} is not valid (its quaternion has length {length:g}, "
            "expected 1)"
        )
