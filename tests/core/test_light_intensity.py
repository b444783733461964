"""What the cause light_intensity says: the ratio that the photos determine."""

from __future__ import annotations

import numpy as np

from patina.core.diagnose.effects.light_intensity import LightIntensity

EFFECT = LightIntensity((0, 1, 2, 3), np.zeros(1, np.intp), (0, 0, 1, 1), ("key", "rim"))


def test_a_drift_of_one_lamp_is_named_where_the_lamps_themselves_are_uncertain():
    x = np.array([0.10, 0.10, -0.16, -0.04])
    sentence = EFFECT.sentence(x, np.full(4, 0.2))
    assert "the lamp 'rim'" in sentence
    assert "photo 4 is 13 % brighter than photo 3" in sentence


def test_the_range_is_named_where_it_is_known():
    x = np.array([0.10, 0.10, -0.16, -0.04])
    sentence = EFFECT.sentence(x, np.full(4, 0.02))
    assert "from -15 % in photo 3 to +11 % in photo 1" in sentence


def test_the_range_is_named_where_no_lamp_drifts():
    sentence = EFFECT.sentence(np.array([0.2, 0.2, -0.2, -0.2]), np.full(4, 0.5))
    assert "relative to the mean" in sentence
