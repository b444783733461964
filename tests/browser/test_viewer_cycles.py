"""The viewer in a browser against Cycles, which evaluates the same BRDFs by OSL."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

import bpy  # noqa: E402
import OpenImageIO as oiio  # noqa: E402

from patina.core.appearance.principled import Principled  # noqa: E402
from patina.core.basis import PrincipalBRDF  # noqa: E402
from patina.core.photo import write_exr  # noqa: E402
from patina.core.viewer import page as viewer_page  # noqa: E402
from patina.core.viewer.model_tables import ViewerMaterial  # noqa: E402
from patina.core.viewer.skies import Sky, computed_skies  # noqa: E402
from patina.scene.export import relight  # noqa: E402
from patina.scene.material import material_nodes  # noqa: E402
from tests.browser import browser  # noqa: E402
from tests.browser.viewed_sphere import new_scene, relative_rms  # noqa: E402
from tests.browser.viewer_camera import LAMP, averaged  # noqa: E402
from tests.projected import projected  # noqa: E402
from tests.wheel import cycles_sphere  # noqa: E402
from tests.wheel.world_light import assign_material  # noqa: E402

if material_nodes.osl_missing():
    pytest.skip(f"{material_nodes.osl_missing()}", allow_module_level=True)

PICTURES = 400  # that the viewer averages
MODELS = {
    "glossy": Principled(base_color=np.array([0.4, 0.1, 0.05]), roughness=0.3),
    "polished": Principled(base_color=np.array([0.02, 0.1, 0.12]), roughness=0.15),
}


@pytest.fixture(scope="module")
def brdfs() -> dict[str, PrincipalBRDF]:
    return {name: projected(model.evaluate, 60) for name, model in MODELS.items()}


@pytest.fixture(scope="module")
def skies() -> list[Sky]:
    shipped = relight.shipped_worlds()
    found = computed_skies()[:1]
    if "forest" in shipped:
        pixels = oiio.ImageBuf(str(shipped["forest"])).get_pixels(oiio.FLOAT)
        found.append(Sky.reduced("Forest", np.asarray(pixels)[..., :3]))
    return found


@pytest.fixture(scope="module")
def page_file(brdfs, skies, tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("viewer") / "viewer.html"
    materials = [ViewerMaterial.of(name, brdf, {}) for name, brdf in brdfs.items()]
    viewer_page.write_viewer(file, "Two spheres", materials, skies)
    return file


@pytest.fixture(scope="module")
def in_browser(page_file, skies) -> dict[tuple[str, str], np.ndarray]:
    """(material, light) → (SIDE, SIDE, 4) mean of the viewer's pictures, row 0 on top."""
    found = {}
    with browser.opened(page_file, (900, 600)) as (page, errors):
        for place, name in enumerate(MODELS):
            for light in ["lamp", *range(len(skies))]:
                state = f"{{ material: {place}, light: {light!r} }}"
                shown = "lamp" if light == "lamp" else skies[light].name
                found[name, shown] = averaged(page, PICTURES, state)
        assert errors == []
    return found


@pytest.mark.parametrize("name", MODELS)
def test_the_viewer_agrees_with_cycles_under_a_lamp(name, brdfs, in_browser, tmp_path):
    sphere = new_scene(samples=256)
    cycles_sphere.sun(LAMP, math.pi)
    assign_material(brdfs[name], sphere)
    expected = cycles_sphere.render(tmp_path)
    error = relative_rms(in_browser[name, "lamp"][..., :3], expected)
    print(f"{name}, lamp: relative RMS {100 * error:.2f} %")
    assert error < 0.02


@pytest.mark.parametrize(("name", "light"), [("glossy", "Studio"), ("polished", "Forest")])
def test_the_viewer_agrees_with_cycles_under_a_sky(name, light, brdfs, skies, in_browser, tmp_path):
    sky = {each.name: each for each in skies}.get(light)
    if sky is None:
        pytest.skip(f"this bpy has no world {light!r}")
    sphere = new_scene(samples=1024)
    file = tmp_path / "sky.exr"
    write_exr(file, sky.radiance)
    relight.light_with(bpy.context.scene, file)
    assign_material(brdfs[name], sphere)
    expected = cycles_sphere.render(tmp_path)
    error = relative_rms(in_browser[name, light][..., :3], expected)
    print(f"{name}, {light}: relative RMS {100 * error:.2f} %")
    assert error < 0.05
