"""The photos of the viewer in a browser: choice of photo and layer, divider, zoom."""

from __future__ import annotations

import re

import numpy as np
import pytest

from patina.core.appearance.principled import Principled
from patina.core.viewer.model_tables import ViewerMaterial
from patina.core.viewer.page import write_viewer
from patina.core.viewer.photo_layers import DIFFERENCE, PHOTO, PREDICTION, PhotoLayers
from tests.browser import browser
from tests.projected import projected
from tools import viewer_program

pytestmark = pytest.mark.slow
MODEL = Principled(base_color=np.array([0.4, 0.1, 0.05]), roughness=0.3)
CAUSE = "Near Light"


def layers(name: str, level: int) -> PhotoLayers:
    grey = [np.full((60, 90, 3), level + step, np.uint8) for step in (0, 20, 40, 60)]
    pictures = dict(zip((PHOTO, PREDICTION, DIFFERENCE, CAUSE), grey, strict=True))
    return PhotoLayers(name, pictures, {CAUSE: "what the cause changes"})


def test_photos_are_compared_with_their_layers(tmp_path):
    browser.program()
    viewer_program.build()
    file = tmp_path / "viewer.html"
    material = ViewerMaterial.of("paint", projected(MODEL.evaluate, 10), {})
    photos = [layers("a.exr", 50), layers("<b>.exr", 120)]
    write_viewer(file, "Two photos", [material], [], photos=photos)
    with browser.opened(file, (1000, 700)) as (page, errors):
        page.get_by_text("Photos", exact=True).click()
        assert page.locator("canvas").is_hidden() and page.locator("#photos").is_visible()
        assert page.locator("#light").is_hidden()
        size = page.evaluate(
            "() => { const i = document.getElementById('right');"
            "return i.decode().then(() => [i.naturalWidth, i.naturalHeight]); }"
        )
        assert size == [90, 60]
        page.locator("#next").click()
        assert page.locator("#name").evaluate("e => e.selectedOptions[0].text") == "<b>.exr"
        assert grey_of(page, "left") == pytest.approx(120, abs=2)
        assert grey_of(page, "right") == pytest.approx(140, abs=2)
        page.get_by_text(CAUSE, exact=True).click()
        assert grey_of(page, "right") == pytest.approx(180, abs=2)
        assert "what the cause changes" in page.locator("#what").text_content()
        half = clip(page)
        page.locator("#divider").fill("80")
        assert clip(page) == pytest.approx(1.6 * half, rel=0.02)
        box = page.locator("#photos").bounding_box()
        page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        page.mouse.wheel(0, -400)
        # the divider stays where it is in the window, so it moves in the enlarged picture
        page.wait_for_function(
            "() => document.getElementById('stack').style.transform.includes('2.7')"
        )
        assert clip(page) < 1.6 * half
        page.get_by_text("Sphere", exact=True).click()
        assert page.locator("canvas").is_visible() and page.locator("#light").is_visible()
        assert errors == []


def grey_of(page, name: str) -> float:
    """Mean of the picture's pixels."""
    return page.evaluate(
        """async (name) => {
          const image = document.getElementById(name);
          await image.decode();
          const canvas = new OffscreenCanvas(90, 60).getContext("2d");
          canvas.drawImage(image, 0, 0);
          const { data } = canvas.getImageData(0, 0, 90, 60);
          return data.reduce((sum, value, i) => sum + (i % 4 < 3 ? value : 0), 0) / (3 * 90 * 60);
        }""",
        name,
    )


def clip(page) -> float:
    """Pixels of the right picture that the divider hides."""
    style = page.locator("#right").evaluate("e => e.style.clipPath")
    return float(re.findall(r"([\d.]+)px\)", style)[0])
