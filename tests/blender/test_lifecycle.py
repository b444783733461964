"""The extension registers and unregisters without leftovers, and brings its own libraries."""

from __future__ import annotations

import importlib
import sys
import tempfile
from pathlib import Path

import addon_utils
import bpy
from support import INSTALLED, ROOT, Skip, extension, installed

LIBRARIES = ("pycolmap", "embreex", "OpenImageIO", "scipy")


def properties() -> set[str]:
    """Every property of every type, as "Type.property"."""
    found = set()
    for name in dir(bpy.types):
        rna = getattr(getattr(bpy.types, name), "bl_rna", None)
        if rna is not None:
            found |= {f"{name}.{one.identifier}" for one in rna.properties}
    return found


def operators() -> set[str]:
    """Every operator, as "group.name"."""
    return {f"{group}.{name}" for group in dir(bpy.ops) for name in dir(getattr(bpy.ops, group))}


def handlers() -> set[str]:
    """Every function that Blender calls by itself, as "list: module.name"."""
    return {
        f"{name}: {function.__module__}.{function.__qualname__}"
        for name in dir(bpy.app.handlers)
        if isinstance(functions := getattr(bpy.app.handlers, name), list)
        for function in functions
    }


def drawn() -> set[str]:
    """Every function added to a menu, panel or header, as "Type: module.name"."""
    return {
        f"{name}: {function.__module__}.{function.__qualname__}"
        for name in dir(bpy.types)
        for function in getattr(getattr(getattr(bpy.types, name), "draw", None), "_draw_funcs", ())
    }


def timers() -> set[str]:
    """Every function of the extension that a timer would still call."""
    package = extension().__name__
    return {
        f"{name}.{key}"
        for name, module in list(sys.modules.items())
        if name == package or name.startswith(package + ".")
        for key, value in list(vars(module).items())
        if callable(value) and not isinstance(value, type) and bpy.app.timers.is_registered(value)
    }


def keys() -> set[str]:
    """Every shortcut in the add-ons' key maps."""
    config = bpy.context.window_manager.keyconfigs.addon
    maps = config.keymaps if config else ()
    return {f"{one.name}: {item.idname}" for one in maps for item in one.keymap_items}


def translated() -> set[str]:
    """The extension's own name, if it has registered translations: Blender accepts a name once."""
    package = extension().__name__
    try:
        bpy.app.translations.register(package, {})
    except ValueError:
        return {package}
    bpy.app.translations.unregister(package)
    return set()


PLACES = {
    "types": lambda: set(dir(bpy.types)),
    "properties": properties,
    "operators": operators,
    "handlers": handlers,
    "menus and panels": drawn,
    "timers": timers,
    "shortcuts": keys,
    "translations": translated,
}


def traces() -> dict[str, set[str]]:
    """Everything that an add-on can leave in Blender."""
    return {place: look() for place, look in PLACES.items()}


def test_extension_is_registered() -> None:
    if not installed():
        raise Skip("no zip is installed here")
    assert addon_utils.check(INSTALLED)[1]
    assert ROOT not in Path(extension().__file__).parents, "this is the checkout, not the zip"


def test_zip_contains_only_shipped_files() -> None:
    if not installed():
        raise Skip("no zip is installed here")
    inside = {path.name for path in Path(extension().__file__).parent.iterdir()}
    foreign = inside & {"tests", "docs", "tools", "run.py", "pyproject.toml", ".ci", ".git"}
    assert not foreign, foreign
    assert {"core", "LICENSE", "blender_manifest.toml"} <= inside


def test_libraries_are_loaded_from_zip() -> None:
    if not installed():
        raise Skip("no zip is installed here")
    for name in LIBRARIES:
        path = importlib.import_module(name).__file__
        assert f"{Path('extensions') / '.local'}" in path, f"{name} is {path}"


def test_numpy_is_that_of_blender() -> None:
    numpy = importlib.import_module("numpy")
    assert ".local" not in Path(numpy.__file__).parts, numpy.__file__


def test_libraries_work() -> None:
    import embreex.mesh_construction
    import embreex.rtcore_scene
    import numpy as np
    import OpenImageIO
    import pycolmap
    import scipy.optimize

    x, _ = scipy.optimize.nnls(np.eye(2), np.array([1.0, 2.0]))
    assert np.allclose(x, [1, 2])
    scene = embreex.rtcore_scene.EmbreeScene()
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], dtype=np.float32)
    embreex.mesh_construction.TriangleMesh(scene, corners)
    origin = np.array([[0.2, 0.2, 1.0]], dtype=np.float32)
    assert scene.run(origin, np.array([[0, 0, -1]], dtype=np.float32))[0] == 0
    assert pycolmap.Rotation3d(np.array([0.0, 0.0, 0.0, 1.0])).matrix().shape == (3, 3)
    image = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(2, 2, 3, "float"))
    assert image.get_pixels().shape == (2, 2, 3)


def test_exr_exchange_with_blender() -> None:
    """Two copies of the OpenEXR code, Blender's and that in our OpenImageIO, in one process."""
    import numpy as np
    import OpenImageIO

    wanted = np.random.default_rng(0).normal(size=(31, 20, 3)).astype(np.float32) * 1000
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "x.exr")
        spec = OpenImageIO.ImageSpec(20, 31, 3, "float")
        spec.attribute("compression", "zip")
        output = OpenImageIO.ImageOutput.create(path)
        assert output.open(path, spec) and output.write_image(wanted), output.geterror()
        output.close()
        image = bpy.data.images.load(path)
        image.colorspace_settings.name = "Non-Color"
        seen = np.array(image.pixels[:], dtype=np.float32).reshape(31, 20, -1)[::-1, :, :3]
        assert np.array_equal(seen, wanted)
        assert np.array_equal(OpenImageIO.ImageBuf(path).get_pixels(), wanted)


def test_register_and_unregister_leave_no_traces() -> None:
    module = extension()
    module.unregister()
    try:
        before = traces()
        for _ in range(20):
            module.register()
            during = traces()
            module.unregister()
            after = traces()
            assert during != before, "register() registered nothing"
            left = {place: sorted(after[place] ^ before[place]) for place in PLACES}
            left = {place: names for place, names in left.items() if names}
            assert not left, f"left behind: {left}"
    finally:
        module.register()


def test_loading_twenty_files_leaves_no_leftovers() -> None:
    """Alternately a file with a capture and one without: nothing accumulates, nothing remains."""
    from test_workflow import folder, make_capture_module

    kinds = ("objects", "cameras", "lights", "images", "collections", "texts", "materials")

    def counts() -> dict[str, int]:
        return {kind: len(getattr(bpy.data, kind)) for kind in kinds}

    def attached() -> int:
        lists = (getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers))
        return sum(len(each) for each in lists if isinstance(each, list))

    place = folder()
    files = [str(place / "empty.blend"), str(place / "capture.blend")]
    bpy.ops.wm.save_as_mainfile(filepath=files[0])
    bpy.ops.patina.import_capture(
        filepath=str(make_capture_module().make_capture(place / "ball", photos=3))
    )
    bpy.ops.wm.save_as_mainfile(filepath=files[1])
    first: dict[str, tuple[dict[str, int], int, dict[str, set[str]]]] = {}
    for k in range(20):
        file = files[k % 2]
        bpy.ops.wm.open_mainfile(filepath=file)
        found = counts(), attached(), traces()
        assert found == first.setdefault(file, found), (k, file)
    empty, full = (first[file] for file in files)
    assert full[0]["images"] == empty[0]["images"] + 3
    assert (full[1], full[2]) == (empty[1], empty[2])


def test_disabled_and_enabled_in_preferences() -> None:
    """As the user does it; meanwhile Blender removes and unpacks the libraries again."""
    if not installed():
        raise Skip("no zip is installed here")

    def fail(error: Exception) -> None:
        raise error

    addon_utils.disable(INSTALLED, default_set=False, handle_error=fail)
    assert not addon_utils.check(INSTALLED)[1]
    addon_utils.enable(INSTALLED, default_set=False, handle_error=fail)
    assert addon_utils.check(INSTALLED)[1]
    assert Path(importlib.import_module("scipy").__file__).exists()
