"""Check that another Blender opens a saved session completely: masks, lights, photos, results.

python tools/window/reopen.py SESSION_FOLDER     (a Python with bpy: any version from the one that
                                                  saved session.blend on)
"""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]


def extension() -> None:
    """Import and register the checkout as package ``patina``."""
    spec = importlib.util.spec_from_file_location(
        "patina", ROOT / "__init__.py", submodule_search_locations=[str(ROOT)]
    )
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["patina"] = module
    spec.loader.exec_module(module)
    module.register()


def main() -> None:
    """Open the file and compare it with the records of the session."""
    folder = Path(sys.argv[-1])
    recorded = json.loads((folder / "session.json").read_text("utf-8"))
    extension()
    bpy.ops.wm.open_mainfile(filepath=str(folder / "session.blend"))
    from patina.scene.material.material_evidence import subject_of
    from patina.scene.material.measured_materials import measured_of
    from patina.scene.paint.mask_images import mask_images, read_mask_image
    from patina.scene.paint.paint_kinds import paints, slots_of_faces
    from patina.scene.session.scene_properties import DIAGNOSIS, capture_path, stored_result
    from patina.scene.views.view_image import view_image

    scene = bpy.context.scene
    capture = capture_path(scene)
    result = stored_result(capture)
    assert {m["name"]: m["samples"]["used"] for m in result["materials"]} == recorded["materials"]
    assert sorted(measured_of(capture)) == sorted(recorded["materials"])
    assert stored_result(capture, DIAGNOSIS) is not None
    for material in measured_of(capture).values():
        assert len(subject_of(material).points) > 100 and subject_of(material).interval is not None
    assert {view_image(kind) is None for kind in ("highlight", "comparison")} == {False}
    photos = scene.patina_photos
    masks = {
        kind: int(read_mask_image(image).sum())
        for (where, kind), image in mask_images(capture).items()
        if where == recorded["painted photo"]
    }
    assert masks == recorded["pixels ignored"], (masks, recorded)
    assert len(photos.photos) == recorded["photos"] and all(p.camera for p in photos.photos)
    lamps = [o for o in scene.objects if o.type == "LIGHT"]
    assert len(lamps) == recorded["lamps"], [o.name for o in lamps]
    materials = [paint for paint in paints(scene) if paint.kind == "material"]
    counts = [int((slots_of_faces(scene.patina.mesh) == paint.slot).sum()) for paint in materials]
    assert counts == recorded["faces"], (counts, recorded)
    print(f"Blender {bpy.app.version_string}: the session is complete")


main()
