"""What a fit or a check was made with, and what of it changed since.

Stored with the result in the .blend as short hashes. The hash of the mesh is computed again only
after Blender reports a change of a mesh, because panels ask at every redraw.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import bpy
import numpy as np

from ..paint.mask_images import mask_images
from ..photos.dragged_lamps import lamp_edits, lamp_of
from ..photos.photo_list import lit_photos
from ..property_keys import RESULT_INPUTS
from ..session.handlers import register_handlers_factory
from ..session.scene_properties import RESULT, capture_path, result_text

DIGITS = 5  # of placements, relative to their size: less is rounding
CHANGES = {
    "mesh": "the mesh was edited",
    "scale": "the mesh was scaled",
    "slots": "materials of the mesh were painted or changed",
    "lamps": "a lamp was moved or deleted",
    "masks": "masks were painted, added or removed",
    "capture": "the capture file was changed",
}

_changes = 0  # of any mesh, as Blender reports them
_hashes: dict[tuple[int, int], tuple[str, str]] = {}  # (session id, changes) → (mesh, slots)


def inputs_now(scene: bpy.types.Scene) -> dict[str, str]:
    """Key of CHANGES → short text that changes with it."""
    capture, mesh = capture_path(scene), scene.patina.mesh
    found = {"mesh": "", "slots": "", "scale": ""}
    if mesh is not None and mesh.type == "MESH" and mesh.name in scene.objects:
        found["mesh"], found["slots"] = _mesh_hashes(mesh.data)
        found["scale"] = _rounded(np.array(mesh.matrix_world.to_scale()))
    lamps = []
    for name in dict.fromkeys(photo.light for photo in lit_photos(scene)):
        lamp = lamp_of(scene, capture, name)
        lamps.append(f"{name} {_lamp_state(scene, lamp)}")
    found["lamps"] = _short("\n".join(lamps).encode())
    masks = [f"{key} {_mask_state(image)}" for key, image in mask_images(capture).items()]
    found["masks"] = _short("\n".join(sorted(masks)).encode())
    found["capture"] = _file_state(Path(capture)) if capture else ""
    return found


def record_inputs(
    scene: bpy.types.Scene, kind: str = RESULT, at_start: dict[str, str] | None = None
) -> None:
    """Store with the result of a fit or a check what it was made with.

    at_start: inputs_now when the job started; what was edited meanwhile is not in its result. The
    slots of the mesh are those of now, because the job assigns them.
    """
    text = result_text(capture_path(scene), kind)
    if text is not None:
        now = inputs_now(scene)
        text[RESULT_INPUTS] = json.dumps({**now, **(at_start or {}), "slots": now["slots"]})


def changes_since(
    scene: bpy.types.Scene, kind: str = RESULT, now: dict[str, str] | None = None
) -> tuple[str, ...]:
    """What changed since the last fit or check, as clauses; () where nothing did, and for results
    of earlier versions. now: inputs_now, if the caller has it already."""
    text = result_text(capture_path(scene), kind)
    try:
        before = json.loads(text[RESULT_INPUTS]) if text is not None else {}
    except (KeyError, TypeError, ValueError):
        return ()
    if not before:
        return ()
    now = now or inputs_now(scene)
    return tuple(CHANGES[key] for key in CHANGES if key in before and before[key] != now[key])


def _mask_state(image: bpy.types.Image) -> str:
    """Changes when the mask is painted: masks are packed when a fit reads them."""
    packed = image.packed_file
    return f"{image.is_dirty} {packed.size if packed is not None else 0}"


def _lamp_state(scene: bpy.types.Scene, lamp: bpy.types.Object | None) -> str:
    if lamp is None:
        return "missing"
    edits = lamp_edits(scene, lamp)
    if edits is None:
        return "of another type"
    return _rounded(np.array(edits.now.values)) if edits else "as imported"


def _mesh_hashes(mesh: bpy.types.Mesh) -> tuple[str, str]:
    """(of the vertices and faces, of the faces' materials)."""
    key = mesh.session_uid, _changes
    if key not in _hashes:
        vertices = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", vertices)
        slots = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", slots)
        shape = f"{len(mesh.polygons)} {len(mesh.loops)}".encode()
        _hashes.clear()
        _hashes[key] = _short(vertices.tobytes() + shape), _short(slots.tobytes())
    return _hashes[key]


def _file_state(path: Path) -> str:
    try:
        state = path.stat()
    except OSError:
        return "missing"
    return f"{state.st_size} {state.st_mtime_ns}"


def _rounded(values: np.ndarray) -> str:
    unit = max(float(np.abs(values).max()), 1e-12)
    return " ".join(f"{v:.{DIGITS}f}" for v in values / unit + 0.0) + f" {unit:.{DIGITS}g}"


def _short(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


@bpy.app.handlers.persistent
def _count(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Count the changes of meshes."""
    global _changes
    if any(u.is_updated_geometry and isinstance(u.id, bpy.types.Mesh) for u in depsgraph.updates):
        _changes += 1


@bpy.app.handlers.persistent
def _forget(*_: object) -> None:
    """Forget the hashes: undo and other files replace meshes without an update."""
    global _changes
    _changes += 1
    _hashes.clear()


register, unregister = register_handlers_factory(
    (
        ("depsgraph_update_post", _count),
        ("undo_post", _forget),
        ("redo_post", _forget),
        ("load_post", _forget),
    )
)
