"""The exported GLB in a browser, drawn by three.js and by Babylon.js, against Cycles with the
measured BRDF."""

from __future__ import annotations

import base64
import math

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

import bpy  # noqa: E402

from patina.core.appearance.principled import Principled  # noqa: E402
from patina.core.photo import write_exr  # noqa: E402
from patina.core.viewer.skies import computed_skies  # noqa: E402
from patina.core.views.display import srgb  # noqa: E402
from patina.scene.export import relight  # noqa: E402
from patina.scene.export.export_gltf import write_glb  # noqa: E402
from patina.scene.material import material_nodes  # noqa: E402
from tests.browser import browser  # noqa: E402
from tests.browser.viewed_sphere import inside, new_scene  # noqa: E402
from tests.browser.viewer_camera import EYE, FIELD, LAMP, SIDE  # noqa: E402
from tests.projected import projected  # noqa: E402
from tests.wheel import cycles_sphere  # noqa: E402
from tests.wheel.world_light import assign_material  # noqa: E402
from tools import viewer_program  # noqa: E402

if material_nodes.osl_missing():
    pytest.skip(f"{material_nodes.osl_missing()}", allow_module_level=True)

MODEL = Principled(base_color=np.array([0.4, 0.1, 0.05]), roughness=0.3)
FINER = 4  # pixels of the browser for each of Cycles, along each side
MIN_PSNR = {"lamp": 35.0, "sky": 25.0}  # dB
BABYLON = browser.FOLDER / "babylon"  # a game engine: its page and the packages that this needs


@pytest.mark.parametrize(
    ("engine", "light"), [("three", "lamp"), ("three", "sky"), ("babylon", "lamp")]
)
def test_the_glb_looks_like_the_measured_material(engine, light, tmp_path):
    browser.program()
    sky = computed_skies()[0] if light == "sky" else None
    sphere = new_scene(samples=64 if sky is None else 700)
    if sky is None:
        cycles_sphere.sun(LAMP, math.pi)
    else:
        write_exr(tmp_path / "sky.exr", sky.radiance)
        relight.light_with(bpy.context.scene, tmp_path / "sky.exr")
    assign_material(projected(MODEL.evaluate, 60), sphere)
    expected = cycles_sphere.render(tmp_path)
    write_glb(tmp_path / "sphere.glb", [sphere])
    found = _drawn(tmp_path, sky, engine)
    error = np.mean((_display(found) - _display(expected))[inside()] ** 2)
    psnr = -10 * np.log10(error)
    print(f"GLB, {engine}, {light}: PSNR {psnr:.1f} dB")
    assert psnr > MIN_PSNR[light]


def _display(radiance: np.ndarray) -> np.ndarray:
    return srgb(np.clip(radiance, 0, 1)) / 255.0


def _drawn(folder, sky, engine) -> np.ndarray:
    """(SIDE, SIDE, 3) linear radiance in the browser, row 0 on top."""
    if engine == "three":
        viewer_program.bundle(browser.FOLDER / "glb_page.js", folder / "glb_page.js")
    else:
        viewer_program.bundle(BABYLON / "glb_page.js", folder / "glb_page.js", BABYLON)
    page_file = folder / "page.html"
    page_file.write_text(
        '<!DOCTYPE html><link rel="icon" href="data:,"><script src="glb_page.js"></script>'
    )
    options = {
        "glb": base64.b64encode((folder / "sphere.glb").read_bytes()).decode(),
        "side": FINER * SIDE,
        "field": FIELD,
        "eye": _y_up(EYE),
        "lamp": None if sky is not None else _y_up(LAMP),
        "sky": None if sky is None else _for_three(sky.radiance),
    }
    with browser.opened(page_file, (300, 200)) as (page, errors):
        text = page.evaluate("(options) => window.drawGlb(options)", options)
        assert errors == []
    side = FINER * SIDE
    fine = np.frombuffer(base64.b64decode(text), "<f4").reshape(side, side, 4)[::-1, :, :3]
    return fine.reshape(SIDE, FINER, SIDE, FINER, 3).mean(axis=(1, 3))


def _y_up(point: np.ndarray) -> list[float]:
    """The point in glTF's frame."""
    x, y, z = point.tolist()
    return [x, z, -y]


def _for_three(radiance: np.ndarray) -> dict[str, object]:
    """The sky as three.js reads equirectangular pictures: bottom row first. Cycles has the azimuth
    arctan(y/x) in column (0.5 − φ/2π), three.js the azimuth arctan(z/x) in column (0.5 + φ/2π), and
    glTF's z is −y: the columns are the same."""
    height, width = radiance.shape[:2]
    four = np.ones((height, width, 4), np.float32)
    four[..., :3] = radiance[::-1]
    return {
        "width": width,
        "height": height,
        "pixels": base64.b64encode(four.tobytes()).decode(),
    }
