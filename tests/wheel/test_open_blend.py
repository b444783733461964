"""The .blend of a result runs no scripts when an export or `maps` opens it."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

import bpy  # noqa: E402

from patina.core.errors import PatinaError  # noqa: E402
from patina.scene.export.open_blend import open_blend  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]


def test_scripts_of_a_blend_do_not_run(tmp_path):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    mark, blend = tmp_path / "ran", tmp_path / "scene.blend"
    text = bpy.data.texts.new("start.py")
    text.write(f"open({str(mark)!r}, 'a').write('ran')\n")
    text.use_module = True
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bpy.ops.wm.open_mainfile(filepath=str(blend), use_scripts=True)
    assert mark.is_file(), "the script of this test would run"
    mark.unlink()
    open_blend(blend)
    assert "start.py" in bpy.data.texts
    assert not mark.exists()


def test_file_that_is_no_blend_is_refused(tmp_path):
    file = tmp_path / "scene.blend"
    file.write_bytes(b"BLENDER" + bytes(100))
    with pytest.raises(PatinaError, match=r"cannot be opened as a \.blend"):
        open_blend(file)


def test_only_open_blend_opens_files():
    """Elsewhere the switch could be forgotten."""
    for room in ("scene", "operators", "commands", "panels"):
        for file in (ROOT / room).rglob("*.py"):
            if file.name != "open_blend.py":
                assert "open_mainfile(" not in file.read_text("utf-8"), file
