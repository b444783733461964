"""The photos of a check in the viewer, on a simulated ball whose photos have a known fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patina.core.concurrency.steps import drained
from patina.core.diagnose.effects.light_intensity import LightIntensity
from patina.core.diagnose.selection.search import search
from patina.core.report.check_layers import BEFORE, check_layers
from patina.core.viewer.photo_layers import DIFFERENCE, PHOTO, PREDICTION, page_data
from tests.make_lit_ball import changed, lit_ball

BRIGHTER, DARKER = 1, 5
CAUSE = "Wrong Light Intensity"


def redness(picture: np.ndarray) -> float:
    """Mean of red minus blue: positive where red prevails."""
    return float((picture[..., 0].astype(float) - picture[..., 2]).mean())


def test_layers_show_what_a_cause_changes() -> None:
    context = lit_ball(1)
    drift = np.array([0.0, 0.25, 0.0, 0.0, 0.0, -0.25])
    gains = np.exp(drift)[context.pixels.photo]
    context = changed(context, context.pixels.observed * gains[:, None])
    found = drained(search(context, np.radians(0.2), [LightIntensity.of(context)], None))
    assert found.causes == ("light_intensity",)
    layers = check_layers(replace(found, photo_names=("a", "b", "c")), context)
    assert [one.name for one in layers] == ["a", "b", "c", "photo 4", "photo 5", "photo 6"]
    for one in layers:
        assert list(one.pictures) == [PHOTO, PREDICTION, DIFFERENCE, BEFORE, CAUSE]
        assert len({picture.shape for picture in one.pictures.values()}) == 1
        assert set(one.texts) == set(one.pictures)
    bright, dark = layers[BRIGHTER].pictures, layers[DARKER].pictures
    # the cause makes one photo brighter (red), and its uncorrected prediction is too dark (blue)
    assert redness(bright[CAUSE]) > 20 and redness(bright[BEFORE]) < -20
    assert redness(dark[CAUSE]) < -20 and redness(dark[BEFORE]) > 20
    assert abs(redness(bright[DIFFERENCE])) < 0.3 * abs(redness(bright[BEFORE]))
    assert page_data(layers)["layer_texts"][CAUSE].startswith("what the cause")
