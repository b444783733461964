"""Lights of a prediction are where the diagnosis of the fit found them."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.angles.vectors import tangents
from patina.core.inputs.lights import Lights
from patina.core.jobs.displaced_lights import displaced_lights, not_applied
from patina.core.light import DistantLight, MountedLight

UP = np.array([0.0, 0.0, 1.0])


def test_a_direction_turns_by_the_stated_angles():
    lights = Lights({"a": DistantLight("a", UP), "b": DistantLight("b", UP)})
    turned = np.tan(np.radians(5.0))
    found = displaced_lights(lights, {"light_direction": {"a, first": turned, "a, second": 0.0}})
    moved = found.by_name["a"].direction
    assert np.degrees(np.arccos(moved @ UP)) == pytest.approx(5.0)
    first, second = (axis[0] for axis in tangents(UP[None]))
    assert moved @ first > 0 and moved @ second == pytest.approx(0.0)
    assert found.by_name["b"].direction == pytest.approx(UP)


def test_a_flash_moves_in_the_frame_of_the_camera():
    lights = Lights({"flash": MountedLight("flash", np.array([0.1, 0.0, 0.0]))})
    ways = {"flash, right": 0.2, "flash, down": -0.5, "flash, forward": 0.1}
    found = displaced_lights(lights, {"flash_offset": ways})
    assert found.by_name["flash"].offset == pytest.approx([0.3, -0.5, 0.1])


def test_other_causes_are_reported():
    effects = {"flash_offset": {}, "vignetting": {"r²": -0.1}}
    assert not_applied(effects) == ("vignetting",)
    lights = Lights({"a": DistantLight("a", UP)})
    assert displaced_lights(lights, effects).by_name["a"].direction == pytest.approx(UP)
