"""Metashape's cameras as written: which are aligned, and which get their pose from a rig's
master."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..parsing.xml_file import line_of
from .metashape_sensors import Sensor, read_sensor
from .metashape_values import Source, flag, numbers, properties

Array = NDArray[np.float64]

MAX_MASTERS = 10  # masters above a camera; Metashape writes one
ROTATION_TOLERANCE = 1e-4  # deviation of R Rᵀ from the identity; handwritten files have few digits


@dataclass(frozen=True)
class Entry:
    """A <camera>. group: label of its folder. element: for what is read later."""

    id: str
    label: str
    group: str
    element: Element

    @property
    def enabled(self) -> bool:
        """Whether the camera is enabled in Metashape."""
        return flag(self.element.get("enabled"), True)

    @property
    def master(self) -> str | None:
        """Id of the rig's master camera; None where the camera has none."""
        master = self.element.get("master_id")
        return None if master in (None, "", self.id) else master

    @property
    def keyframe(self) -> bool:
        """Whether it is a viewpoint without a photo."""
        return not (self.element.get("sensor_id") or self.element.get("master_id"))


class Rig:
    """The cameras and sensors of a chunk. Raises InputError for duplicate ids, and, when a sensor
    or pose is read, for missing or invalid values."""

    def __init__(self, chunk: Element, file: Source) -> None:
        self.file = file
        self.entries: dict[str, Entry] = {}
        cameras = chunk.find("cameras")
        for element, group in _cameras(cameras if cameras is not None else (), ""):
            identity = element.get("id", "")
            if not identity or identity in self.entries:
                found = (
                    f"two cameras with the id {identity!r}" if identity else "a camera has no id"
                )
                raise InputError(found, file=file, line=line_of(element))
            label = (element.get("label") or "").strip() or f"camera {identity}"
            self.entries[identity] = Entry(identity, label, group, element)
        self._elements: dict[str, Element] = {}
        for element in chunk.iterfind("sensors/sensor"):
            identity = element.get("id", "")
            if identity in self._elements:
                raise InputError(
                    f"two sensors with the id {identity!r}", file=file, line=line_of(element)
                )
            self._elements[identity] = element
        self._sensors: dict[str, Sensor] = {}
        self._poses: dict[str, Array | None] = {}

    def sensor(self, entry: Entry) -> Sensor:
        """The sensor of the camera's photo."""
        identity = entry.element.get("sensor_id", "")
        if identity not in self._sensors:
            if identity not in self._elements:
                raise InputError(
                    f"{entry.label!r} refers to the sensor {identity!r}, which is not in the chunk",
                    file=self.file,
                    line=line_of(entry.element),
                )
            self._sensors[identity] = read_sensor(self._elements[identity], self.file)
        return self._sensors[identity]

    @property
    def used(self) -> list[Sensor]:
        """The sensors read so far."""
        return list(self._sensors.values())

    @property
    def rolling(self) -> bool:
        """Whether any photo was taken with a rolling shutter."""
        return any(
            element.find("rolling_shutter") is not None
            or properties(element).get("rolling_shutter", "0").lower() not in ("0", "false", "none")
            for element in (*(e.element for e in self.entries.values()), *self._elements.values())
        )

    def component(self, entry: Entry) -> str:
        """Id of the camera's component; its master's where it has none."""
        for _ in range(MAX_MASTERS):
            own = entry.element.get("component_id")
            if own is not None or entry.master not in self.entries:
                break
            entry = self.entries[entry.master]
        return entry.element.get("component_id", "")

    def pose(self, entry: Entry) -> Array | None:
        """(4, 4) camera → chunk (or component); None where it is not aligned."""
        chain = [entry]
        while entry.id not in self._poses:
            own = entry.element.find("transform")
            if own is not None and (own.text or "").strip():
                self._poses[entry.id] = _rigid(numbers(own, 16, self.file), own, self.file)
                break
            if entry.master is None:
                self._poses[entry.id] = None
                break
            if entry.master not in self.entries or len(chain) > MAX_MASTERS:
                known = entry.master in self.entries
                found = "leads back to itself" if known else "is not in the chunk"
                raise InputError(
                    f"{entry.label!r}: its master camera {entry.master!r} {found}",
                    file=self.file,
                    line=line_of(entry.element),
                )
            entry = self.entries[entry.master]
            chain.append(entry)
        for slave, master in zip(chain[-2::-1], chain[:0:-1], strict=True):
            above = self._poses[master.id]
            self._poses[slave.id] = None if above is None else above @ self._between(slave, master)
        return self._poses[chain[0].id]

    def _between(self, slave: Entry, master: Entry) -> Array:
        """(4, 4) slave → master, from the poses of their sensors in the rig."""
        return np.linalg.inv(self._place(master)) @ self._place(slave)

    def _place(self, entry: Entry) -> Array:
        element = self._elements.get(entry.element.get("sensor_id", ""))
        offset = self.sensor(entry).offset
        if offset is None:
            return np.eye(4)
        return _rigid(offset, element, self.file)


def _cameras(parent: Element | tuple[()], group: str) -> Iterator[tuple[Element, str]]:
    """Every <camera> in a tree of groups, with the label of its group."""
    for child in parent:
        if child.tag == "camera":
            yield child, group
        elif child.tag == "group":
            label = (child.get("label") or "").strip() or f"group {child.get('id', '')}".strip()
            yield from _cameras(child, label)


def _rigid(matrix: Array, element: Element | None, file: Source) -> Array:
    """The rigid transform nearest to a (4, 4) matrix, which may deviate by rounding only. Raises
    InputError."""
    matrix = matrix.reshape(4, 4)
    rotation = matrix[:3, :3]
    small = np.abs(rotation).max() < 2  # squares of larger values may overflow
    square = small and np.allclose(rotation @ rotation.T, np.eye(3), atol=ROTATION_TOLERANCE)
    if not (square and np.linalg.det(rotation) > 0 and np.allclose(matrix[3], (0, 0, 0, 1))):
        raise InputError(
            "a transform that is not rigid; expected 16 numbers, the rows of a 4 × 4 "
            "matrix, without scale or reflection",
            file=file,
            line=line_of(element),
        )
    left, _, right = np.linalg.svd(rotation)
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = left @ right, matrix[:3, 3]
    return moved
