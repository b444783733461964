"""``render``: fitted materials under environment images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

import bpy  # noqa: E402
import OpenImageIO as oiio  # noqa: E402

from patina.commands import render as command  # noqa: E402
from patina.core.errors import InputError  # noqa: E402
from patina.core.photo import write_exr  # noqa: E402
from patina.scene.export import relight  # noqa: E402
from tests.make_result import two_materials  # noqa: E402


def picture(file: Path) -> np.ndarray:
    return np.array(oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT))[..., :3]


def test_one_sphere_for_each_material_and_environment(tmp_path):
    sky = np.full((32, 64, 3), 0.3, np.float32)
    write_exr(tmp_path / "even.exr", sky)
    sky[8:10, 20:22] = 300.0
    write_exr(tmp_path / "lamp.exr", sky)
    result = two_materials(tmp_path / "result")
    environments = [str(tmp_path / name) for name in ("even.exr", "lamp.exr")]
    found = command.render_to_folder(
        result, tmp_path / "out", environments, 40, 16, 2, denoise=False
    )
    spheres = [p for p in found if p.turn is None]
    assert {p.world for p in spheres} == {"even", "lamp"}
    assert (tmp_path / "out" / "index.html").is_file()
    for p in spheres:
        pixels = picture(tmp_path / "out" / p.file)
        assert pixels.shape == (40, 40, 3) and 0.02 < pixels[15:25, 15:25].mean() < 1
    even, lamp = (picture(tmp_path / "out" / p.file) for p in spheres[:: len(spheres) // 2])
    assert lamp.mean() > even.mean()


def test_invalid_environment_gives_one_line_error(tmp_path):
    with pytest.raises(InputError, match="neither a file nor an environment image") as raised:
        relight.find_worlds([str(tmp_path / "none.hdr")])
    assert "\n" not in str(raised.value)
    (tmp_path / "text.hdr").write_text("not a picture")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with pytest.raises(InputError, match="environment image; expected"):
        relight.light_with(bpy.context.scene, tmp_path / "text.hdr")
