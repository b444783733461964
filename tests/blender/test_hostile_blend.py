"""A hostile .blend that names files of its choice: when it is opened without scripts and saved,
none of them is written.
"""

from __future__ import annotations

import json
import logging
import os
from pathlib import Path

import bpy
import numpy as np
from support import Skip, extension
from test_workflow import folder

VALID = "patina_components_0123456789ab.exr"
NOT_EXR = "patina_brdf_0123456789ab.exr"
LINKED = "patina_sampling_0123456789ab.exr"
LINKED_PART = "patina_sampling_ba9876543210.exr"


def packed(name: str, data: bytes) -> None:
    """An image data-block of that name with these packed bytes."""
    image = bpy.data.images.new("made", 1, 1)
    image.pack(data=data, data_len=len(data))
    image.name, image.use_fake_user = name, True


def exr(place: Path) -> bytes:
    write = extension("core.appearance.osl_atlas").write_picture
    return write(place / "any.exr", np.ones((2, 2, 3), np.float32)).read_bytes()


def material(name: str, **names: object) -> bpy.types.Material:
    """A material with these file names, and a shader whose files do not exist."""
    made = bpy.data.materials.new(name)
    made.use_fake_user = True
    for key, value in names.items():
        made[f"patina_{key}"] = value
    made["patina_components"] = names.get("components", VALID)
    made.use_nodes = True
    node = made.node_tree.nodes.new("ShaderNodeScript")
    extension("scene.material.material_nodes").ensure_sockets(node, 1)
    for socket in node.inputs:
        if socket.identifier in ("components", "remainder", "sampling"):
            socket.default_value = "/nowhere/at/all.exr"
    return made


def files(place: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(place)): path.read_bytes()
        for path in sorted(place.rglob("*"))
        if path.is_file() and ".blend" not in path.suffix
    }


def hostile() -> tuple[Path, Path, bytes]:
    """(folder of everything, the .blend, the valid EXR); the files around it are its targets."""
    place = folder()
    inner = place / "a" / "b"
    inner.mkdir(parents=True)
    (place / "victim.txt").write_bytes(b"before")
    data = exr(place)
    (place / "any.exr").unlink()
    names = {
        "up": "../../evil.pth",
        "new folder": "../new/evil.pth",
        "absolute": str(place / "absolute.pth"),
        "backslashes": "..\\evil.pth",
        "other suffix": "patina_components_0123456789ab.pth",
        "own name elsewhere": f"../{VALID}",
        "line end": VALID + "\n",
    }
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    for label, name in names.items():
        packed(name, data)
        material(label, components=name)
        material(f"{label}, the other properties", remainder=name, measured_sampling=name)
    material("zero", components=7)  # the last one: its handler may fail
    packed(NOT_EXR, b"import os\n")
    material("not an EXR", remainder=NOT_EXR)
    for name in (LINKED, LINKED_PART):
        packed(name, data)
        material(name, sampling=name)
    packed(VALID, data)
    material("good", components=VALID)
    broken = material("broken json")
    broken["patina_as_measured"] = '{"solid": 5'
    blend = inner / "hostile.blend"
    with WithoutHandlers():
        bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    for link in (LINKED, LINKED_PART + ".part"):
        try:
            os.symlink(place / "victim.txt", inner / link)
        except OSError as error:  # Windows without the permission to make links
            raise Skip(f"no symbolic links here: {error}") from error
    return place, blend, data


class WithoutHandlers:
    """Without the extension's handlers, as on the machine of the .blend's author."""

    def __enter__(self) -> None:
        extension("scene.material.osl_files").unregister()

    def __exit__(self, *_: object) -> None:
        extension("scene.material.osl_files").register()


def opened(blend: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(blend), use_scripts=False)


def test_hostile_blend_writes_no_file_outside() -> None:
    place, blend, data = hostile()
    own = extension("scene.session.folders").own_folder()
    before, own_before = files(place), set(own.rglob("*"))
    opened(blend)
    bpy.ops.wm.save_mainfile()
    now = files(place)
    expected = {**before, str((blend.parent / VALID).relative_to(place)): data}
    assert now == expected, sorted(set(now) ^ set(expected))
    assert set(own.rglob("*")) == own_before
    assert not (place / "a" / "new").exists()
    assert os.path.islink(blend.parent / LINKED)  # neither replaced nor written through
    assert (place / "victim.txt").read_bytes() == b"before"


def test_valid_file_is_restored_on_load() -> None:
    _, blend, data = hostile()
    opened(blend)
    material = bpy.data.materials["good"]
    osl_files = extension("scene.material.osl_files")
    (node,) = osl_files.script_nodes(material)
    sockets = {s.identifier: s for s in node.inputs}
    assert Path(sockets["components"].default_value) == blend.parent / VALID
    assert (blend.parent / VALID).read_bytes() == data
    assert "up" in osl_files.restore() and sockets["sampling"].default_value.startswith("/nowhere")


def test_rejections_say_what_was_found_and_what_to_do() -> None:
    _, blend, _ = hostile()
    messages: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda record: messages.append(record.getMessage())
    root = logging.getLogger(extension().__name__)
    root.addHandler(handler)
    try:
        opened(blend)
        bpy.ops.wm.save_mainfile()
    finally:
        root.removeHandler(handler)
    text = "\n".join(messages)
    for found in ("evil.pth", "not an EXR", LINKED, "symbolic link", "fit the material again"):
        assert found in text, (found, text)


def test_damaged_property_does_not_stop_handlers() -> None:
    _, blend, _ = hostile()
    opened(blend)
    parts = extension("scene.material.measured_nodes")
    material = bpy.data.materials["broken json"]
    for damaged_value in ("{", "5", "[]", '{"solid": 5}', '{"solid": [1, "x", {}]}', "[" * 5000):
        material["patina_as_measured"] = damaged_value
        material["patina_measured_sampling"] = "../../evil.pth"
        parts.restore_inputs(material)
        assert "patina_as_measured" not in material
        assert material.get("patina_sampling") != "../../evil.pth"


def test_restored_values_refer_to_no_other_file() -> None:
    _, blend, _ = hostile()
    opened(blend)
    parts, files = extension("scene.material.measured_nodes"), extension("scene.material.osl_files")
    material = bpy.data.materials["good"]
    shader = {"label": "as measured", "values": {"sampling": "/etc/passwd"}}
    kept = {"solid": [[1, 0, 0, 1], 0, 1], "principled": None, "lobes": None, "shaders": [shader]}
    material["patina_as_measured"] = json.dumps(kept)
    parts.restore_inputs(material)
    (node,) = files.script_nodes(material)
    sockets = {s.identifier: s for s in node.inputs}
    assert node.label == "as measured" and tuple(material.diffuse_color) == (1, 0, 0, 1)
    assert sockets["sampling"].default_value == "/nowhere/at/all.exr"


def test_mask_of_unknown_kind_gives_no_file_name() -> None:
    masks = extension("scene.paint.mask_images")
    for kind in ("shadow", "x/../../../evil", "..\\evil", 5):
        image = bpy.data.images.new(f"mask {kind}", 2, 2)
        image["patina_capture"], image["patina_shadow_of"], image["patina_mask"] = "a.toml", 0, kind
    assert set(masks.mask_images("a.toml")) == {(0, "shadow")}


def test_network_path_is_not_accessed() -> None:
    trusted = extension("scene.material.osl_files").is_trusted_path
    place = folder()
    (place / VALID).write_bytes(exr(place))
    assert trusted(str(place / VALID)) and not trusted("/" + str(place / VALID))
    assert not trusted("\\\\server\\share\\" + VALID) and not trusted(str(place / "any.exr"))
