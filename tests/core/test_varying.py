"""The variation of a material over a surface is found in photos of another model than Patina's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.angles import Angles, light_view
from patina.core.basis import default_basis
from patina.core.concurrency.steps import drained
from patina.core.fit.measured import fit_measured
from patina.core.varying import radiance_error
from patina.core.varying.choice import Nodes, choose
from patina.core.varying.conversion import typical_parameters, typical_samples
from patina.core.varying.hierarchy import NodeFields
from patina.core.varying.node_model import (
    COUNT,
    DIFFUSE,
    TILT,
    Shading,
    specular_factor,
    tilted,
)
from patina.core.varying.varying_surface import VARIATIONS
from tests.core.varying_scene import (
    ALBEDO,
    GOLD,
    SPACING,
    VaryingScene,
    fitted_model,
    ggx,
    scene,
)


@pytest.fixture(scope="module")
def model():
    return fitted_model()


def solved(model, made: VaryingScene) -> NodeFields:
    *_, (_, fields) = nodes_of(made).solve(model, made.seen, list(VARIATIONS)[-1])
    return fields


def nodes_of(made: VaryingScene) -> Nodes:
    return Nodes(made.points, made.normals, SPACING, SPACING)


def angle(one, other):
    return np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", one, other), -1, 1)))


def test_derivatives_are_those_of_the_radiance(model):
    rng = np.random.default_rng(2)
    up = np.tile([0.0, 0.0, 1.0], (50, 1)) + 0.3 * rng.normal(size=(50, 3))
    normal = (up / np.linalg.norm(up, axis=1, keepdims=True)).astype(np.float32)
    made = scene(1, 3)
    seen = Shading(*(a[:50] for a in made.seen.shading))
    parameters = 0.1 * rng.normal(size=(50, COUNT)).astype(np.float32)
    radiance, slope = model.derivatives(seen, normal, parameters, np.ones(COUNT, bool))
    way = 0.003 * rng.normal(size=(50, COUNT)).astype(np.float32)
    other = model.radiance(seen, normal, parameters + way)
    expected = radiance + np.einsum("mcp,mp->mc", slope, way)
    assert np.linalg.norm(expected - other) < 0.3 * np.linalg.norm(other - radiance)


def test_colour_and_normals_are_found(model):
    made = scene(10, 0, tilt=3.0)
    fields = solved(model, made)
    found = ALBEDO * np.exp(fields.parameters[:, DIFFUSE])
    ratio = np.log(found / made.colour)
    before = np.log(ALBEDO / made.colour)
    assert ratio.std() < 0.25 * before.std()
    normal = tilted(made.normals, fields.parameters)
    assert np.median(angle(normal, made.true_normals)) < 0.4 * np.median(
        angle(made.normals, made.true_normals)
    )


def test_coloured_highlights_are_found(model):
    """Gold beside white: the colour of the highlight changes, and not that of the diffuse part."""
    made = scene(16, 4, vary=False, gold=True)
    fields = solved(model, made)
    found = np.log(specular_factor(fields.parameters))
    red_to_blue = found[:, 0] - found[:, 2]
    gold, white = made.points[:, 0] > 0.1, made.points[:, 0] < -0.1
    true = np.log(GOLD[0] / GOLD[2])
    assert np.median(red_to_blue[gold]) == pytest.approx(true, rel=0.25)
    assert abs(np.median(red_to_blue[white])) < 0.15 * true
    colour = fields.parameters[gold][:, DIFFUSE]
    assert abs(np.median(colour[:, 0] - colour[:, 2])) < 0.05 * true


def test_small_parts_keep_their_hue(model, monkeypatch):
    """Dots of another hue, and errors of the brightness that are alike in all channels: the prior
    makes them grey if the errors of the channels are taken for independent."""
    made, rng = scene(4, 5, vary=False), np.random.default_rng(6)
    dots = np.all(np.sin(12 * made.points[:, :2]) > 0.9, axis=1)
    seen, hue = made.seen, np.where(dots[:, None], [1 / 1.6, 1.0, 1.6], 1.0)
    grey = np.exp(0.25 * rng.normal(size=(len(seen), 1)))
    radiance = (seen.radiance * hue[seen.node] * grey).astype(np.float32)
    made = replace(made, seen=replace(seen, radiance=radiance))

    def blue_to_red() -> float:
        """In the dots, relative to the truth, logarithmic."""
        parameters = solved(model, made).parameters[dots][:, DIFFUSE]
        return float(np.median(parameters[:, 2] - parameters[:, 0]) / np.log(1.6**2))

    assert 0.75 < blue_to_red() < 1.25
    monkeypatch.setattr(radiance_error, "MAX_HUE_RATIO", 1.0)
    assert blue_to_red() < 0.5


def test_clipped_highlights_are_at_least_white(model):
    """Highlights of gold that are clipped in all photos but one, which is predicted."""
    made = scene(10, 4, vary=False, gold=True)
    white = np.float32(np.quantile(made.seen.radiance, 0.9))
    clipped = made.seen.radiance > white
    gold = made.points[made.seen.node, 0] > 0
    brightest = np.bincount(made.seen.photo, clipped.any(axis=1) & gold).argmax()
    held = made.seen.photo == brightest
    limited = np.minimum(made.seen.radiance, white)
    limited = replace(made.seen, radiance=limited, clipped=clipped).select(~held)
    out, bright = made.seen.select(held & gold), clipped[held & gold]

    def shortfall(observations):
        fields = solved(model, replace(made, seen=observations))
        theta = fields.parameters[out.node]
        predicted = model.radiance(out.shading, made.normals[out.node], theta)
        return np.median(np.log(out.radiance / predicted)[bright])

    assert shortfall(limited) < 0.7 * shortfall(limited.measured())


@pytest.mark.slow
def test_typical_material_keeps_highlights_that_are_clipped(model):
    """Clipped observations become lower limits of the typical material, for its stripe or not. The
    normals of the scan are off: without the limits, dark pixels alone would show the highlight."""
    made = scene(6, 5, tilt=4.0)
    white = np.float32(np.quantile(made.seen.radiance, 0.97))
    clipped = made.seen.radiance > white
    limited = replace(made.seen, radiance=np.minimum(made.seen.radiance, white), clipped=clipped)
    parameters = np.zeros((len(made.points), COUNT), np.float32)
    parameters[:, DIFFUSE] = np.log(made.colour / ALBEDO)
    exact, some = limited.measured(), limited.select(clipped.any(axis=1))
    typical = typical_parameters(exact, parameters)
    table, limits = (
        typical_samples(model, one, made.points, made.normals, parameters, typical)
        for one in (exact, some)
    )
    assert np.array_equal(limits.response == 0, some.clipped) and (table.response == 1).all()
    angles = Angles(*(np.full(5, v, np.float32) for v in (0.02, 0.5, 1.5)))
    light, view = light_view(*angles)
    true = ALBEDO / np.pi + ggx(np.tile([0.0, 0.0, 1.0], (5, 1)), light, view)[:, None]
    kept, lost = (
        fit_measured(table, default_basis(), clipped=one).brdf.evaluate(angles).mean() / true.mean()
        for one in (limits, None)
    )
    assert 0.6 < kept < 1.6 and abs(np.log(kept)) < abs(np.log(lost))


def test_standard_errors_cover_the_errors_of_the_colour(model):
    made = scene(6, 1)
    fields = solved(model, made)
    error = np.log(ALBEDO * np.exp(fields.parameters[:, DIFFUSE]) / made.colour)
    error -= error.mean(axis=0)  # a level common to all nodes is that of the fit
    within = np.abs(error) < 1.645 * np.sqrt(fields.variance[:, DIFFUSE])
    assert 0.8 < within.mean() <= 1.0


def test_photo_that_was_not_seen_is_predicted_better(model):
    made = scene(8, 4)
    held = made.seen.photo == 7
    few = VaryingScene(
        made.points, made.normals, made.true_normals, made.colour, made.seen.select(~held)
    )
    out = made.seen.select(held)
    theta = solved(model, few).parameters[out.node]
    normal = made.normals[out.node]

    def error(parameters):
        predicted = model.radiance(out.shading, normal, parameters)
        return np.sqrt(np.mean((predicted / out.radiance - 1) ** 2))

    assert error(theta) < 0.4 * error(np.zeros_like(theta))


@pytest.mark.slow
def test_surface_that_varies_is_distinguished_from_an_even_one(model):
    for vary, expected in ((True, "diffuse"), (False, "even")):
        made = scene(6, 5, vary=vary)
        found = drained(choose([(kind, model) for kind in VARIATIONS], made.seen, nodes_of(made)))
        assert found.kind.startswith(expected), found


def test_variation_is_found_where_each_photo_shows_another_part(model):
    """What no fitted photo shows is predicted alike with and without variation, and says nothing
    about it."""
    made = scene(6, 5)
    strip = (made.points[:, 0] - made.points[:, 0].min()) // 0.3 % 3  # each in two photos
    own = strip[made.seen.node] == made.seen.photo // 2
    found = drained(
        choose(
            [(kind, model) for kind in ("even", "diffuse")], made.seen.select(own), nodes_of(made)
        )
    )
    assert found.kind == "diffuse"
    assert found.typical["diffuse"] < 0.6 * found.typical["even"]


def test_nodes_without_photos_take_the_values_around_them(model):
    made = scene(6, 6)
    hole = np.abs(made.points[:, :2]).max(axis=1) < 0.06
    few = made.seen.select(~hole[made.seen.node])
    fields = solved(model, VaryingScene(made.points, made.normals, made.true_normals,
                                        made.colour, few))  # fmt: skip
    found = np.log(ALBEDO * np.exp(fields.parameters[hole][:, DIFFUSE]) / made.colour[hole])
    assert np.abs(found).max() < 0.4
    colour = fields.variance[:, DIFFUSE]
    assert colour[hole].mean() > 1.3 * colour[~hole].mean()
    assert np.abs(fields.parameters[hole][:, TILT]).max() < 0.1
