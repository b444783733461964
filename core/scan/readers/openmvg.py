"""Reader for OpenMVG's sfm_data.json.

openMVG, src/openMVG/sfm/sfm_data_io_cereal.cpp and src/openMVG/cameras. The cereal library writes
the name of a type at its first occurrence and refers to it by number later. Poses are world →
camera (x right, y down, z forward); the rotation is stored row by row, with a centre. Pixels are
counted as in OpenMVG's own export to COLMAP.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..camera import Camera, Pose
from ..lenses.brown import Lens, brown_lens, fisheye_lens, panorama_lens
from ..parsing.json_file import read_json
from ..parsing.json_record import Record, root_record
from ..parsing.photo_labels import labels_of
from ..parsing.sparse import sparse_points
from ..reconstruction import Reconstruction, reconstruction_of

Array = NDArray[np.float64]

FIRST_OCCURRENCE_FLAG = 1 << 31  # added by cereal to an id at its first occurrence
MODELS = (
    "pinhole", "pinhole_radial_k1", "pinhole_radial_k3", "pinhole_brown_t2", "fisheye", "spherical",
)  # fmt: skip


def read_openmvg(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras and points of an sfm_data.json. Raises InputError."""
    if chunk is not None:
        raise InputError("OpenMVG's files have no chunks", file=path, key="scan.chunk")
    data = root_record(read_json(path), path)
    poses = {
        entry.identity("key"): _pose(entry.record("value")) for entry in data.records("extrinsics")
    }
    intrinsics = {key: (record, kind) for key, record, kind in _pointed(data, "intrinsics")}
    lenses: dict[str, tuple[int, int, str, tuple[float, ...]]] = {}  # of those that are used
    views = _pointed(data, "views")
    names = [view.text("local_path", "") + "/" + view.text("filename") for _, view, _ in views]
    labels = labels_of(names, path)
    cameras = []
    for label, name, (_, view, _) in zip(labels, names, views, strict=True):
        pose = poses.get(view.identity("id_pose"))
        key = view.identity("id_intrinsic")
        if pose is None or key not in intrinsics:
            continue
        if key not in lenses:
            lenses[key] = _intrinsic(*intrinsics[key])
        lens = lenses[key]
        width, height = view.whole("width", 0), view.whole("height", 0)
        if (width, height) != lens[:2] and width and height:
            raise view.error(
                f"the photo has {width} × {height} pixels; its intrinsics are for {lens[0]} × "
                f"{lens[1]}",
                "width",
            )
        cameras.append(Camera(label, *lens, pose, name.lstrip("/")))
    notes = []
    if not poses:
        raise InputError(
            "holds no pose (extrinsics): it was written before the reconstruction ran; "
            "expected its output",
            file=path,
        )
    if len(cameras) < len(views):
        notes.append(
            f"Photos without a pose or a lens that were left out: {len(views) - len(cameras)}."
        )
    points, _, more = sparse_points(_structure(data))
    return reconstruction_of(
        cameras, path, points=points, colours=np.full((len(points), 3), 128, np.uint8),
        notes=(*notes, *more),
    )  # fmt: skip


def _structure(data: Record) -> Array:
    """(n, 3) positions of the landmarks."""
    values = [entry.get("value") for entry in _plain(data, "structure")]
    return Record({"structure": values}, data.file).table("structure", "X", 3)


def _plain(data: Record, key: str) -> list[dict[str, object]]:
    """A list of objects without checks of their members, for long lists."""
    rows = data.values.get(key) or []
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise data.error("is not a list of objects", key)
    return rows


def _pointed(data: Record, key: str) -> list[tuple[str, Record, str]]:
    """(key, object, name of its type) of cereal's map of shared pointers. A pointer that occurred
    before is only a reference."""
    types: dict[int, str] = {}
    known: dict[int, Record] = {}
    found = []
    for entry in data.records(key):
        value = entry.record("value")
        number = value.whole("polymorphic_id", 0)
        if "polymorphic_name" in value:
            types[number % FIRST_OCCURRENCE_FLAG] = value.text("polymorphic_name")
        pointer = value.record("ptr_wrapper")
        identity = pointer.whole("id", 0)
        if "data" in pointer:
            known[identity % FIRST_OCCURRENCE_FLAG] = _unwrapped(pointer.record("data"))
        if identity % FIRST_OCCURRENCE_FLAG not in known:
            raise pointer.error(f"is {identity}, which refers to no object", "id")
        found.append(
            (
                entry.identity("key"),
                known[identity % FIRST_OCCURRENCE_FLAG],
                types.get(number % FIRST_OCCURRENCE_FLAG, ""),
            )
        )
    return found


def _unwrapped(record: Record) -> Record:
    """The object with its inherited members: cereal nests a base class as value0."""
    values = record.values
    for _ in range(3):
        base = values.get("value0")
        if not isinstance(base, dict):
            break
        values = {**base, **{k: v for k, v in values.items() if k != "value0"}}
    return Record(values, record.file, record.where)


def _intrinsic(record: Record, kind: str) -> tuple[int, int, str, tuple[float, ...]]:
    """(width, height, model, parameters)."""
    width, height = record.whole("width"), record.whole("height")
    return width, height, *_lens(record, kind, width, height)


def _lens(record: Record, kind: str, width: int, height: int) -> Lens:
    if kind not in MODELS:
        raise record.error(
            f"the lens {kind[:40]!r} is not supported; expected one of {', '.join(MODELS)}",
            "polymorphic_name",
        )
    if kind == "spherical":
        if width != 2 * height:
            raise record.error(
                "is a panorama that is not twice as wide as high, which is not supported", "width"
            )
        return panorama_lens(width, height)
    f = record.number("focal_length")
    cx, cy = (float(v) for v in record.numbers("principal_point", 2))
    if kind == "pinhole":
        return brown_lens(f, f, cx, cy)
    if kind == "pinhole_radial_k1":
        return brown_lens(f, f, cx, cy, _parameters(record, "disto_k1", 1))
    if kind == "pinhole_radial_k3":
        return brown_lens(f, f, cx, cy, _parameters(record, "disto_k3", 3))
    if kind == "fisheye":
        return fisheye_lens(f, f, cx, cy, _parameters(record, "fisheye", 4))
    brown = _parameters(record, "disto_t2", 5)
    return brown_lens(f, f, cx, cy, brown[:3], brown[3:])


def _parameters(record: Record, key: str, count: int) -> list[float]:
    return [float(v) for v in record.numbers(key, count)]


def _pose(record: Record) -> Pose:
    rotation = record.numbers("rotation", 9).reshape(3, 3)
    return Pose(rotation, -rotation @ record.numbers("center", 3))
