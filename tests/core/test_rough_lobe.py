"""How far a lobe without a highlight can be told from a diffuse colour."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.varying.node_model import COUNT, DIFFUSE, NodeModel
from patina.core.varying.rough_lobe import rough_lobe_albedo, rough_lobe_variance
from patina.core.varying.split import BodySplit

BODY = np.array([0.1, 0.02, 0.01], np.float32)  # 1/sr


def model_with(body, scale=1.0, share=0.5):
    return NodeModel(None, BodySplit(np.asarray(body), share, whole=False), scale)


def test_albedo_is_the_mean_of_a_ggx_lobe_as_rough_as_can_be():
    """π D F G / (4 cos θi cos θo) with α = 1, D, Smith's G and F of an index of
    1.5 from their definitions, at random directions within 60 degrees of the normal."""
    rng, alpha = np.random.default_rng(0), 1.0
    sine = np.sin(np.radians(60)) * np.sqrt(rng.random((2, 20_000)))
    turn, cosine = 2 * np.pi * rng.random(sine.shape), np.sqrt(1 - sine**2)
    way = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], axis=-1)
    half = way.sum(axis=0) / np.linalg.norm(way.sum(axis=0), axis=1, keepdims=True)
    d = alpha**2 / (np.pi * (half[:, 2] ** 2 * (alpha**2 - 1) + 1) ** 2)
    masked = 0.5 * (np.sqrt(1 + alpha**2 * (sine / cosine) ** 2) - 1)
    g = 1 / (1 + masked.sum(axis=0))
    outside = np.arccos(np.sum(half * way[0], axis=1))
    inside = np.arcsin(np.sin(outside) / 1.5)  # Snell
    across = np.sin(outside - inside) / np.sin(outside + inside)  # Fresnel
    along = np.tan(outside - inside) / np.tan(outside + inside)
    f = (across**2 + along**2) / 2
    albedo = np.pi * d * f * g / (4 * cosine.prod(axis=0))
    assert rough_lobe_albedo() == pytest.approx(albedo.mean(), rel=0.02)


def test_dark_colours_are_known_less_well():
    parameters = np.zeros((2, COUNT))
    parameters[1, DIFFUSE] = np.log(0.5)
    found = np.sqrt(rough_lobe_variance(model_with(BODY), parameters))
    assert found[0, DIFFUSE] == pytest.approx(rough_lobe_albedo() / (np.pi * BODY))
    assert found[1, DIFFUSE] == pytest.approx(2 * found[0, DIFFUSE])
    assert np.all(found[:, DIFFUSE.stop :] == 0)


def test_a_brighter_photo_changes_nothing():
    """The BRDF of the fit is that of the photos divided by the scale."""
    parameters = np.zeros((1, COUNT))
    one = rough_lobe_variance(model_with(BODY), parameters)
    other = rough_lobe_variance(model_with(3 * BODY, 3.0), parameters)
    assert other == pytest.approx(one)


def test_metal_has_no_diffuse_colour():
    found = rough_lobe_variance(model_with([1e-3] * 3, share=0.05), np.zeros((4, COUNT)))
    assert np.all(found == 0)
