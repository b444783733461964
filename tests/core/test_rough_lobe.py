"""How far a lobe without a highlight can be told from a diffuse colour."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.appearance.layer_albedo import F0_OF_GLASS
from patina.core.varying.node_model import COUNT, DIFFUSE, NodeModel
from patina.core.varying.rough_lobe import ROUGH_LOBE_ALBEDO, rough_lobe_variance
from patina.core.varying.split import EVERYTHING

BODY = np.array([0.1, 0.02, 0.01], np.float32)  # 1/sr


def model_with(body, scale=1.0):
    return NodeModel(None, np.asarray(body, np.float32), scale)


def test_albedo_is_that_of_a_ggx_lobe_as_rough_as_can_be():
    """The distribution of GGX with α = 1, seen and lit along the normal: D = 1/π, G = 1."""
    alpha = 1.0
    lobe = F0_OF_GLASS / (np.pi * alpha**2) / 4  # D F G / (4 cos θi cos θo)
    assert np.pi * lobe == pytest.approx(ROUGH_LOBE_ALBEDO)


def test_dark_colours_are_known_less_well():
    parameters = np.zeros((2, COUNT))
    parameters[1, DIFFUSE] = np.log(0.5)
    found = np.sqrt(rough_lobe_variance(model_with(BODY), parameters))
    assert found[0, DIFFUSE] == pytest.approx(ROUGH_LOBE_ALBEDO / (np.pi * BODY))
    assert found[1, DIFFUSE] == pytest.approx(2 * found[0, DIFFUSE])
    assert np.all(found[:, DIFFUSE.stop :] == 0)


def test_a_brighter_photo_changes_nothing():
    """The BRDF of the fit is that of the photos divided by the scale."""
    parameters = np.zeros((1, COUNT))
    one = rough_lobe_variance(model_with(BODY), parameters)
    other = rough_lobe_variance(model_with(3 * BODY, 3.0), parameters)
    assert other == pytest.approx(one)


def test_metal_has_no_diffuse_colour():
    found = rough_lobe_variance(model_with([EVERYTHING] * 3), np.zeros((4, COUNT)))
    assert np.all(found == 0)
