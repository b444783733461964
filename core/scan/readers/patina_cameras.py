"""Reader and writer for cameras that were localised in a scan: Patina's own file, *.cameras.json.

  {"patina_cameras": 1, "frame": "mesh", "cameras": [{"label": …, "width": …, "height": …,
  "model": …, "parameters": […], "rotation": [[3 × 3]], "translation": [3], "photo": …, …}]}

model, parameters: as in core/scan/lens.py. rotation, translation: world → camera, x right, y down,
z forward. frame: "mesh" where a mesh was available (the frame that read_scan converts the scan's
cameras to), else "cameras" (the reconstruction's own). Numbers are written with full precision.
Further keys of a camera state its accuracy; readers ignore them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
from numpy.typing import NDArray

from ...errors import InputError
from ..camera import Camera, Pose
from ..lens import make_lens
from ..parsing.json_file import read_json
from ..reconstruction import MAX_SIDE, Reconstruction, reconstruction_of

KEY = "patina_cameras"
VERSION = 1
FRAMES = ("mesh", "cameras")
MAX_PARAMETERS = 32


def read_patina_cameras(
    path: Path, images: Path | None = None, chunk: str | None = None
) -> Reconstruction:
    """The cameras of such a file. images is not needed: sizes are in it. Raises InputError."""
    if chunk is not None:
        raise InputError("has no chunks; expected one in a Metashape file", file=path)
    data = read_json(path)
    if not isinstance(data, dict) or KEY not in data:
        raise InputError(f"is not a file of localised cameras; expected the key {KEY!r}", file=path)
    if data[KEY] != VERSION:
        raise InputError(f"found version {data[KEY]!r}, expected {VERSION}", file=path, key=KEY)
    if data.get("frame") not in FRAMES:
        raise InputError(
            f"found {data.get('frame')!r}, expected one of {', '.join(FRAMES)}",
            file=path,
            key="frame",
        )
    listed = data.get("cameras")
    if not isinstance(listed, list):
        raise InputError("expected a list of cameras", file=path, key="cameras")
    return reconstruction_of([_camera(entry, i, path) for i, entry in enumerate(listed)], path)


def write_patina_cameras(
    path: Path,
    cameras: Sequence[Camera],
    frame: str,
    more: Sequence[Mapping[str, object]] = (),
    earlier: Path | None = None,
) -> None:
    """Write cameras. ``more``: further keys of each camera. earlier: a file whose cameras come
    first, without those of a label that is written now."""
    entries = [
        {
            "label": camera.label,
            "width": camera.width,
            "height": camera.height,
            "model": camera.model,
            "parameters": [float(p) for p in camera.parameters],
            "rotation": camera.pose.rotation.tolist(),
            "translation": camera.pose.translation.tolist(),
            "photo": camera.photo,
            **(more[i] if more else {}),
        }
        for i, camera in enumerate(cameras)
    ]
    if earlier is not None:
        known = {camera.label for camera in cameras}
        kept = [entry for entry in read_json(earlier)["cameras"] if entry["label"] not in known]
        entries = [*kept, *entries]
    data = {KEY: VERSION, "frame": frame, "cameras": entries}
    path.write_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n", "utf-8")


def _camera(entry: Any, place: int, path: Path) -> Camera:
    where = f"cameras {place + 1}"
    if not isinstance(entry, dict):
        raise InputError("expected an object with one camera", file=path, key=where)
    label, model, photo = (entry.get(name) for name in ("label", "model", "photo"))
    if not isinstance(label, str) or not label:
        raise InputError("expected the camera's label, as text", file=path, key=f"{where}.label")
    if not (photo is None or isinstance(photo, str)):
        raise InputError("expected a file name, as text", file=path, key=f"{where}.photo")
    width, height = (_side(entry.get(name), name, where, path) for name in ("width", "height"))
    parameters = _numbers(entry, "parameters", None, where, path)
    rotation = _numbers(entry, "rotation", (3, 3), where, path)
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) or np.linalg.det(rotation) < 0:
        raise InputError("is not a rotation matrix", file=path, key=f"{where}.rotation")
    translation = _numbers(entry, "translation", (3,), where, path)
    try:
        if not isinstance(model, str):
            raise ValueError
        lens = make_lens(model, width, height, parameters.tolist())
        if isinstance(lens, pycolmap.Camera) and not lens.verify_params():
            raise ValueError
    except Exception as error:  # lens code raises many types for invalid values
        raise InputError(
            f"found {str(model)[:40]!r} with {len(parameters)} parameters; expected a lens model "
            "and its number of parameters",
            file=path,
            key=f"{where}.model",
        ) from error
    pose = Pose(rotation, translation)
    return Camera(label, width, height, model, tuple(parameters.tolist()), pose, photo)


def _side(value: Any, name: str, where: str, path: Path) -> int:
    if isinstance(value, int) and not isinstance(value, bool) and 0 < value <= MAX_SIDE:
        return value
    raise InputError("expected a number of pixels", file=path, key=f"{where}.{name}")


def _numbers(
    entry: dict[str, Any], name: str, shape: tuple[int, ...] | None, where: str, path: Path
) -> NDArray[np.float64]:
    expected = "×".join(map(str, shape)) if shape else "a list of"
    try:
        flat = json.dumps(entry.get(name))
        if any(sign in flat for sign in '"tfn{'):  # text, true, false, null
            raise ValueError
        values = np.array(entry.get(name), np.float64)
    except (ValueError, TypeError, OverflowError) as error:
        raise InputError(
            f"expected {expected} numbers", file=path, key=f"{where}.{name}"
        ) from error
    fits = values.shape == shape if shape else values.ndim == 1 and len(values) <= MAX_PARAMETERS
    if not fits or not np.isfinite(values).all():
        raise InputError(f"expected {expected} finite numbers", file=path, key=f"{where}.{name}")
    return values
