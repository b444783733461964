"""Variation that is known before a diagnosis: texture neither hides an effect nor imitates one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.angles import half_difference
from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.concurrency.steps import drained
from patina.core.diagnose.correction.sample_correction import model_at_pixels
from patina.core.diagnose.effects.ambient_light import AmbientLight
from patina.core.diagnose.effects.light_intensity import LightIntensity
from patina.core.diagnose.forward.diagnosis_context import NearestPixels
from patina.core.diagnose.forward.known_variation import KnownVariation, VariationAtPixels
from patina.core.diagnose.forward.shading_state import ShadingState
from patina.core.diagnose.nuisances.fine_variation import FineVariation
from patina.core.diagnose.selection.baseline import fit_baseline
from patina.core.diagnose.selection.effect_trials import held_out_predictions, try_effect
from patina.core.diagnose.selection.scan_quality import ScanQuality
from patina.core.diagnose.solver.model import Model
from patina.core.varying.choice import Nodes, varies_within
from patina.core.varying.node_model import COUNT, DIFFUSE, GLOSS, SPECULAR, TILT, NodeModel
from patina.core.varying.node_variation import MaterialNodes, NodeVariation
from tests.core.varying_scene import SPACING, fitted_model, scene
from tests.make_lit_ball import GLOSSY, PHOTOS, changed, lit_ball

GAINS = 0.03 * np.array([1.0, -1.0, 0.5, -0.5, 1.0, -1.0])  # ln, of the photos
CONTRAST = 0.3  # of the logarithm of the reflectance
NORMALS = np.radians(0.3)
ACROSS = 8  # patches: the ball has few pixels


def stripes(point):
    """(n, 3) factor of the reflectance: stripes that are narrower than a patch."""
    phase = 95 * point @ np.array([0.8, 0.5, 0.33])
    return np.exp(CONTRAST * np.sin(phase))[:, None] * np.ones(3)


class Striped(KnownVariation):
    def at(self, pixels):
        factor = stripes(pixels.point).astype(np.float32)
        return VariationAtPixels(factor, factor, pixels.normal)


def striped_ball(gains, known):
    context = lit_ball(1, GLOSSY)
    pixels = context.pixels
    factor = np.exp(gains)[pixels.photo][:, None] * stripes(pixels.point)
    context = changed(context, factor * pixels.observed)
    noise = pixels.noise * np.square(factor)
    return replace(
        context,
        pixels=replace(context.pixels, noise=noise.astype(np.float32)),
        variation=Striped() if known else None,
    )


def trial_of_drift(context):
    now = fit_baseline(context, NORMALS, ACROSS).fitted
    return now, try_effect(now, held_out_predictions(now), LightIntensity.of(context))


@pytest.mark.parametrize(("waves", "textured"), [(0.0, False), (4.0, False), (70.0, True)])
def test_only_what_varies_within_a_patch_is_texture(waves, textured):
    """Colour that varies slowly looks like a wrong light, and is left to the patches."""
    made = scene(6, 0, vary=False)
    factor = np.exp(CONTRAST * np.sin(waves * made.points[made.seen.node, 0]))[:, None]
    seen = replace(made.seen, radiance=(factor * made.seen.radiance).astype(np.float32))
    nodes = Nodes(made.points, made.normals.astype(np.float32), SPACING, SPACING)
    found = drained(varies_within(2 / 36, fitted_model(), seen, nodes, "diffuse"))
    assert found == textured


@pytest.mark.slow
def test_a_drift_is_found_beside_texture_only_if_that_is_known():
    """The gain of the hidden drift is many times larger, and its size is right."""
    _, unknown = trial_of_drift(striped_ball(GAINS, known=False))
    now, known = trial_of_drift(striped_ball(GAINS, known=True))
    assert known.gain > 5 * max(unknown.gain, 1.0)
    found = known.effect.identified(known.x)
    assert found == pytest.approx(GAINS - GAINS.mean(), abs=0.007)
    albedo = ScanQuality.of(now).albedo
    assert albedo is not None and albedo < 1.3 * CONTRAST


@pytest.mark.slow
def test_no_drift_is_found_beside_known_texture_where_there_is_none():
    _, trial = trial_of_drift(striped_ball(np.zeros(PHOTOS), known=True))
    assert trial.change < 0.004
    assert trial.ratio < 3


def test_light_from_all_around_is_reflected_by_the_albedo_too():
    context = striped_ball(np.zeros(PHOTOS), known=True)
    fine, ambient = FineVariation.of(context), AmbientLight.of(context)
    x = ambient.parameters.initial + 0.1
    plain = Model(context.pixels, context.brdfs, (ambient,), (x,))
    varied = Model(context.pixels, context.brdfs, (fine, ambient), (np.zeros(0), x))
    lit = plain.predicted() > 1e-6
    ratio = varied.predicted() / np.where(lit, plain.predicted(), 1.0)
    assert ratio[lit] == pytest.approx(stripes(context.pixels.point)[lit], rel=1e-4)


def test_samples_of_the_second_fit_are_those_of_the_typical_material():
    """Reflectance under the model's irradiance no longer has the texture."""
    context = striped_ball(np.zeros(PHOTOS), known=True)
    half = np.arange(0, len(context.pixels), 2)
    other = replace(context, pixels=context.pixels.select(half))
    model = Model(
        context.pixels, context.brdfs, (FineVariation.of(context),), (np.zeros(0),), frozenset({0})
    )
    local = model_at_pixels(model, other, NearestPixels(half, half))
    now = local.shading()
    rho = other.pixels.observed / now.received
    true = context.brdfs.evaluate_one(0, ShadingState.of(other.pixels).angles)
    assert np.std(np.log(rho / true)) < 0.02 < 0.1 < np.std(np.log(stripes(other.pixels.point)))


def nodes_of_wall(parameters):
    """Nodes on both sides of a thin wall at z = 0, with the same parameters on each side."""
    step = np.linspace(-0.5, 0.5, 21)
    x, y = (a.ravel() for a in np.meshgrid(step, step))
    points = np.stack([x, y, np.zeros_like(x)], axis=1)
    normals = np.zeros_like(points, np.float32)
    normals[:, 2] = 1
    thickness = np.array([0, 0, 1e-4])
    both = Nodes(
        np.concatenate([points + thickness, points - thickness]),
        np.concatenate([normals, -normals]), 0.05, 0.05,
    )  # fmt: skip
    count = len(points)
    theta = np.zeros((2 * count, COUNT), np.float32)
    theta[:count], theta[count:] = parameters
    return both, theta


@pytest.mark.parametrize("side", [0, 1])
def test_pixels_have_the_parameters_of_their_side_of_a_wall(side):
    front, back = np.zeros(COUNT, np.float32), np.zeros(COUNT, np.float32)
    front[DIFFUSE], front[SPECULAR], front[GLOSS] = (0.4, 0.3, 0.2), 0.5, 0.2
    back[DIFFUSE] = -0.5
    back[TILT] = 0.0, 0.1, 0.0
    nodes, theta = nodes_of_wall((front, back))
    basis = default_basis()
    brdf = PrincipalBRDF(basis, basis.training[3 * GLOSSY : 3 * GLOSSY + 3])
    variation = NodeVariation({0: MaterialNodes(nodes, NodeModel.of(brdf), theta)})
    pixels = lit_ball().pixels.select(np.arange(60))
    rng = np.random.default_rng(0)
    point = np.concatenate([rng.uniform(-0.4, 0.4, (60, 2)), np.zeros((60, 1))], axis=1)
    away = np.array([0, 0, 1.0 if side == 0 else -1.0])
    towards = rng.normal(size=(2, 60, 3)) + 3 * away
    light, view = towards / np.linalg.norm(towards, axis=2, keepdims=True)
    pixels = replace(
        pixels, point=point, normal=np.tile(away, (60, 1)).astype(np.float32),
        light=light.astype(np.float32), view=view.astype(np.float32),
    )  # fmt: skip
    found = variation.at(pixels)
    own = (front, back)[side]
    share = NodeModel.of(brdf).split.share  # of the diffuse part of a metal
    albedo = share * np.exp(own[DIFFUSE]) + (1 - share) * np.exp(own[SPECULAR])
    assert found.albedo == pytest.approx(np.tile(albedo, (60, 1)), rel=1e-4)
    normal = away + own[TILT]
    normal = normal / np.linalg.norm(normal)
    assert found.normal == pytest.approx(np.tile(normal, (60, 1)), abs=1e-4)
    angles = half_difference(found.normal, pixels.light, pixels.view)
    model = NodeModel.of(brdf)
    varied = model.reflectance(angles, np.tile(own, (60, 1)))
    typical = model.reflectance(angles, np.zeros((60, COUNT), np.float32))
    lit = typical > 0
    assert lit.mean() > 0.9
    assert found.reflectance[lit] == pytest.approx(varied[lit] / typical[lit], rel=1e-3)


def test_a_material_without_nodes_is_even():
    pixels = lit_ball().pixels
    found = NodeVariation({}).at(pixels)
    assert np.all(found.reflectance == 1) and np.all(found.albedo == 1)
    assert np.array_equal(found.normal, pixels.normal)
