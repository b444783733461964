"""Scales of texels from their samples: robust, weighted, and smooth where there are no samples."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.angles import Angles
from patina.core.maps.slots import SLOTS, TexelSamples, TexelSlots
from patina.core.maps.solve import solve_texels, weighted_median
from patina.core.maps.surround import VertexScales
from patina.core.maps.texels import rasterise
from patina.core.scan import Mesh
from patina.core.varying.split import EVERYTHING, split_body


def filled_slots(samples):
    """Slots of n texels from a list of (scale (n, 3), error (n,), gloss (n,))."""
    n = len(samples[0][0])
    slots = TexelSlots.empty(n)
    for scale, error, gloss in samples:
        zero = np.zeros(n)
        slots.add(TexelSamples(np.arange(n), scale, error, zero, gloss, np.zeros(n, np.uint8)))
    return slots


def solve_slots(slots, n):
    return solve_texels(slots, np.zeros(n, np.uint8), slice(0, n))


def test_scale_is_weighted_mean_with_its_standard_error():
    rng = np.random.default_rng(0)
    n, truth = 4000, np.array([0.5, 1.0, 1.6])
    errors = (0.03, 0.06, 0.06, 0.12)
    noise = [truth + e * rng.normal(size=(n, 3)) for e in errors]
    slots = filled_slots(
        [(s, np.full(n, e), np.zeros(n)) for s, e in zip(noise, errors, strict=True)]
    )
    found = solve_slots(slots, n)
    assert np.abs(found.scale.mean(axis=0) - truth).max() < 0.003
    best = 1 / np.sqrt(sum(e**-2 for e in errors))
    assert found.scale.std(axis=0).max() < 1.25 * best  # loss of efficiency of the robust estimator
    stated_error = 1 / np.sqrt(np.median(found.weight))
    assert 0.7 * best < stated_error < 1.5 * best


def test_outlier_photo_is_downweighted():
    rng = np.random.default_rng(1)
    n = 2000
    good = [(1 + 0.04 * rng.normal(size=(n, 3)), np.full(n, 0.05), np.zeros(n)) for _ in range(4)]
    shadow = (np.full((n, 3), 0.1), np.full(n, 0.05), np.zeros(n))
    plain = np.mean([s[0] for s in (*good, shadow)])
    found = solve_slots(filled_slots([*good, shadow]), n)
    assert abs(found.scale.mean() - 1) < 0.02 < abs(plain - 1)
    agreeing = solve_slots(filled_slots(good), n)  # the disagreement shows in the standard error
    assert np.median(found.spread) > 2 * np.median(agreeing.spread)


def test_texel_without_samples_has_no_estimate():
    found = solve_slots(TexelSlots.empty(5), 5)
    assert np.isnan(found.scale).all() and (found.weight == 0).all()
    assert (found.gloss == 0).all() and np.isinf(found.gloss_error).all()


def test_samples_of_other_material_are_ignored():
    slots = TexelSlots.empty(2)
    for number, value in ((0, 1.0), (1, 3.0)):
        slots.add(TexelSamples(
            np.arange(2), np.full((2, 3), value), np.full(2, 0.05), np.zeros(2), np.zeros(2),
            np.full(2, number, np.uint8),
        ))  # fmt: skip
    found = solve_texels(slots, np.array([0, 1], np.uint8), slice(0, 2))
    assert np.allclose(found.scale, [[1.0] * 3, [3.0] * 3], atol=1e-3)


def test_most_precise_samples_are_kept_when_slots_are_full():
    n, count = 50, 3 * SLOTS
    errors = np.random.default_rng(2).permutation(np.linspace(0.05, 1.0, count))
    slots = filled_slots([(np.full((n, 3), e), np.full(n, e), np.zeros(n)) for e in errors])
    kept = np.sort(slots.error[:, 0].astype(float))
    assert np.allclose(kept, np.sort(errors)[:SLOTS], rtol=2e-3)
    assert (slots.count == count).all()


def test_gloss_is_estimated_from_highlights_independently_of_colour():
    rng = np.random.default_rng(3)
    n = 3000
    body = rng.uniform(0.4, 1.6, n)
    truth = rng.uniform(-0.4, 0.4, n)
    samples = []
    for q in (-6.0, -2.0, 0.5, 1.0, 0.0, 0.0):
        error = np.full(n, 0.05 + 0.1 * abs(q))
        value = body + truth * q + error * rng.normal(size=n)
        samples.append((np.repeat(value[:, None], 3, axis=1), error, np.full(n, q)))
    found = solve_slots(filled_slots(samples), n)
    known = np.isfinite(found.gloss_error)
    assert known.mean() > 0.9
    assert np.corrcoef(found.gloss[known], truth[known])[0, 1] > 0.8
    assert np.sqrt(np.mean((found.gloss[known] - truth[known]) ** 2)) < 0.15
    assert np.sqrt(np.mean((found.scale.mean(axis=1) - body) ** 2)) < 0.06


def test_gloss_is_unchanged_without_highlight():
    n = 100
    samples = [(np.full((n, 3), v), np.full(n, 0.05), np.zeros(n)) for v in (0.9, 1.0, 1.1)]
    found = solve_slots(filled_slots(samples), n)
    assert (found.gloss == 0).all()


def test_weighted_median_uses_weights():
    values = np.array([[1.0], [2.0], [10.0]])
    assert weighted_median(values, np.array([[1.0], [1.0], [5.0]]))[0] == 10.0
    assert weighted_median(values, np.array([[1.0], [1.0], [1.0]]))[0] == 2.0
    assert weighted_median(values, np.zeros((3, 1)))[0] == 0.0


def strip(columns):
    """A flat strip of unit squares along x."""
    x = np.arange(columns + 1.0)
    points = np.concatenate([
        np.stack([x, 0 * x, 0 * x], 1), np.stack([x, 0 * x + 1, 0 * x], 1)
    ])  # fmt: skip
    a = np.arange(columns)
    b = a + columns + 1
    faces = np.concatenate([np.stack([a, a + 1, b], 1), np.stack([b, a + 1, b + 1], 1)])
    uv = points[:, :2] / [columns, columns]
    return Mesh(points, faces.astype(np.int32), uv=uv[faces].astype(np.float32))


def test_unobserved_region_falls_back_from_neighbours_to_fit():
    mesh = strip(200)
    texels = rasterise(mesh, 400)
    x = texels.points(mesh, slice(None))[:, 0]
    seen = np.flatnonzero(x < 20)
    sums = VertexScales.empty(len(mesh.vertices), 3)
    sums.add(mesh, texels, seen, np.full((len(seen), 3), 2.0), np.full(len(seen), 400.0))
    interpolated = sums.interpolated(mesh, 1.0)[:201, 0]
    assert np.allclose(interpolated[:19], 2.0, atol=0.02)
    assert (np.diff(interpolated[20:]) <= 1e-3).all()  # smooth fallback
    assert interpolated[25] > 1.8 and abs(interpolated[200] - 1.0) < 0.15


def test_without_observations_scales_are_those_of_fit():
    mesh = strip(3)
    sums = VertexScales.empty(len(mesh.vertices), 2)
    assert (sums.interpolated(mesh, 1.0) == 1.0).all()


def coated(diffuse, strength, alpha):
    """Lambertian part and a GGX-like lobe, reciprocal."""

    def evaluate(angles: Angles):
        c2 = np.cos(angles.theta_h) ** 2
        lobe = alpha**2 / (np.pi * (c2 * (alpha**2 - 1) + 1) ** 2)
        return np.asarray(diffuse) / np.pi + (strength * lobe)[:, None] * np.ones(3)

    return evaluate


@pytest.mark.parametrize("alpha", [0.05, 0.15, 0.3])
def test_body_of_coated_surface_is_its_diffuse_part(alpha):
    diffuse = np.array([0.5, 0.2, 0.08])
    found = split_body(coated(diffuse, 0.012, alpha))
    assert not found.whole
    assert np.abs(np.pi * found.body - diffuse).max() < 0.01
    rho = np.array([[1.0, 0.01, 0.02]])
    body, specular = found.parts(rho)
    assert (body >= 0).all() and (specular >= 0).all() and np.allclose(body + specular, rho)


def test_metal_is_scaled_as_a_whole():
    found = split_body(coated([0.0, 0.0, 0.0], 0.25, 0.2))
    assert found.whole and found.body[0] == EVERYTHING
    body, specular = found.parts(np.array([[5.0, 4.0, 1.0]]))
    assert (specular == 0).all() and body[0, 0] == 5.0
