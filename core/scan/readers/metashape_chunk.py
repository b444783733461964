"""Convert a Metashape chunk to a Reconstruction."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..camera import Camera, Pose
from ..parsing.xml_file import line_of
from ..reconstruction import Reconstruction, Similarity, reconstruction_of
from .metashape_frames import between, read_georeference, read_transform
from .metashape_rig import Entry, Rig
from .metashape_values import Source

Array = NDArray[np.float64]

CHUNK_TRANSFORM = "chunk transform"


@dataclass(frozen=True)
class Chunk:
    """label, id: label and id of the chunk. element: its <chunk>. file: name for messages. photos:
    photo paths by camera id, where they are written in another file. notes: sentences about how the
    chunk was found."""

    label: str
    id: str
    element: Element
    file: Source
    photos: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def has_poses(self) -> bool:
        """Whether any camera is aligned."""
        return any(camera.find("transform") is not None for camera in self.element.iter("camera"))


def read_chunk(chunk: Chunk) -> Reconstruction:
    """Aligned cameras of the chunk, in the frame they are written in (the chunk's or its
    component's), the transform to the world's frame, and the georeference. Raises InputError."""
    rig = Rig(chunk.element, chunk.file)
    notes = list(chunk.notes)
    posed = _posed(chunk, rig, notes)
    transforms = {
        component.get("id", ""): read_transform(component, chunk.file)
        for component in chunk.element.iterfind("components/component")
    }
    base = _base_component(chunk, rig, posed, notes)
    label_of = dict(zip(posed, _labels(list(posed.values()), notes), strict=True))
    cameras, left_out = [], 0
    for identity, entry in posed.items():
        camera = _camera(entry, label_of[identity], chunk, rig)
        component = rig.component(entry)
        if component != base:
            source, target = transforms.get(component), transforms.get(base)
            if source is None or target is None:
                left_out += 1
                continue
            camera = between(source, target).camera(camera)
        cameras.append(camera)
    if left_out:
        notes.append(
            f"{_count(left_out, 'camera')} of other components left out: no transform relates "
            f"{'it' if left_out == 1 else 'them'} to component {base}."
        )
    chunk_transform = read_transform(chunk.element, chunk.file)
    base_transform = transforms.get(base)
    frames: dict[str, Similarity] = {}
    if chunk_transform is not None:
        frames[CHUNK_TRANSFORM] = chunk_transform
    if base_transform is not None and not _same(base_transform, chunk_transform):
        frames[f"component {base}"] = base_transform
    centre = np.mean([camera.pose.centre for camera in cameras], axis=0)
    georeference, georeference_notes = read_georeference(
        chunk.element, base_transform or chunk_transform, centre
    )
    notes += [*(note for sensor in rig.used for note in sensor.notes), *georeference_notes]
    return reconstruction_of(
        cameras, chunk.file, frames=frames, georeference=georeference, notes=tuple(notes)
    )


def _posed(chunk: Chunk, rig: Rig, notes: list[str]) -> dict[str, Entry]:
    """Cameras to read, by id. Adds to ``notes`` what is left out. Raises InputError where no camera
    remains."""
    enabled = [e for e in rig.entries.values() if e.enabled and not e.keyframe]
    posed = {entry.id: entry for entry in enabled if rig.pose(entry) is not None}
    if not posed:
        where = f"the chunk {chunk.label!r} " if chunk.label else "the chunk "
        if not rig.entries:
            found = "holds no cameras"
        elif not enabled:
            found = f"has {_count(len(rig.entries), 'camera')}, none of them enabled"
        else:
            found = f"has {_count(len(enabled), 'camera')}, none of them aligned"
        raise InputError(
            f"{where}{found}; expected a chunk with aligned photos; run Align "
            "Photos, then File > Export > Export Cameras",
            file=chunk.file,
            line=line_of(chunk.element),
        )
    disabled = sum(not entry.enabled for entry in rig.entries.values())
    keyframes = sum(entry.keyframe for entry in rig.entries.values())
    unaligned = len(enabled) - len(posed)
    if disabled:
        notes.append(f"{_count(disabled, 'disabled camera')} left out.")
    if keyframes:
        notes.append(f"{_count(keyframes, 'viewpoint')} without a photo left out.")
    if unaligned:
        notes.append(f"{unaligned} of {_count(len(enabled), 'camera')} left out: not aligned.")
    if rig.rolling:
        notes.append("Rolling shutter is not modelled: each photo has one pose.")
    slaves = sum(entry.master is not None and _own(entry) is None for entry in posed.values())
    if slaves:
        notes.append(f"{_count(slaves, 'camera')} placed by the rig's master camera.")
    return posed


def _own(entry: Entry) -> Element | None:
    """The transform of the camera itself; None where it has none."""
    element = entry.element.find("transform")
    return None if element is None or not (element.text or "").strip() else element


def _base_component(chunk: Chunk, rig: Rig, posed: dict[str, Entry], notes: list[str]) -> str:
    """The component whose frame the reconstruction uses: the active one where it has cameras (the
    chunk's model is in its frame), else the largest."""
    members = Counter(rig.component(entry) for entry in posed.values())
    components = chunk.element.find("components")
    active = components.get("active_id") if components is not None else None
    base = active if active in members else members.most_common(1)[0][0]
    if len(members) > 1:
        which = "the active one" if base == active else "the largest"
        notes.append(
            f"The chunk has {len(members)} components; the frame is that of component {base}, "
            f"{which}."
        )
    return str(base)


def _camera(entry: Entry, label: str, chunk: Chunk, rig: Rig) -> Camera:
    sensor = rig.sensor(entry)
    pose = rig.pose(entry)
    assert pose is not None
    rotation = pose[:3, :3].T
    photo = chunk.photos.get(entry.id) or _photo(entry.element)
    return Camera(
        label=label,
        width=sensor.width,
        height=sensor.height,
        model=sensor.model,
        parameters=sensor.parameters,
        pose=Pose(rotation, -rotation @ pose[:3, 3]),
        photo=photo,
    )


def _photo(camera: Element) -> str | None:
    """Path of the photo, where the camera element holds it."""
    for name in (".//photo", ".//image"):
        element = camera.find(name)
        if element is not None and element.get("path"):
            return element.get("path")
    return None


def _labels(entries: list[Entry], notes: list[str]) -> list[str]:
    """A unique label for each camera: its own; "group/label" where several have the same; with the
    camera's id added where that is not enough."""
    labels = [entry.label for entry in entries]
    for name in (lambda e: f"{e.group}/{e.label}" if e.group else e.label, lambda e: None):
        counts = Counter(labels)
        labels = [
            label if counts[label] == 1 else name(entry) or f"{label} [{entry.id}]"
            for label, entry in zip(labels, entries, strict=True)
        ]
    changed = [
        (entry.label, label)
        for entry, label in zip(entries, labels, strict=True)
        if label != entry.label
    ]
    if changed:
        old_label, new_label = changed[0]
        notes.append(
            f"{_count(len(changed), 'camera')} with a duplicate label renamed, "
            f"for example {old_label!r} to {new_label!r}."
        )
    return labels


def _same(first: Similarity, second: Similarity | None) -> bool:
    return second is not None and bool(
        np.allclose(first.rotation, second.rotation)
        and np.allclose(first.translation, second.translation)
        and np.isclose(first.scale, second.scale)
    )


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def with_notes(chunk: Chunk, *notes: str) -> Chunk:
    """The chunk with further notes."""
    return replace(chunk, notes=(*chunk.notes, *notes))
