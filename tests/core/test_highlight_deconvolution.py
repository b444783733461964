"""Highlights blurred by an area light: predicted with the blur, and deconvolved as long as the
error of held-out photos decreases."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from patina.core.basis import PrincipalBRDF
from patina.core.concurrency.job import Step
from patina.core.concurrency.steps import drained
from patina.core.diagnose.correction.sample_correction import CorrectedSamples, correct_samples
from patina.core.diagnose.effects.area_light import AreaLight
from patina.core.diagnose.effects.vignetting import Vignetting
from patina.core.diagnose.forward.material_brdfs import MaterialBRDFs
from patina.core.diagnose.solver.model import Model
from patina.core.fit.held_out import HeldOutErrors
from patina.core.jobs import highlight_deconvolution_passes
from patina.core.jobs.highlight_deconvolution_passes import fit_with_deconvolution
from tests.core.test_sample_correction import rows_of, table_of
from tests.make_lit_ball import GLOSSY, changed, lit_ball

ANGULAR_RADIUS = np.array([np.radians(14.0)])


@pytest.fixture(scope="module")
def area_light_ball() -> tuple[CorrectedSamples, PrincipalBRDF, np.ndarray]:
    """Samples of a glossy ball under an area light with vignetting, the true BRDF, and the
    radiance without vignetting (n, 3)."""
    context = lit_ball(7, GLOSSY)
    model = Model(context.pixels, context.brdfs).with_effect(AreaLight.of(context), ANGULAR_RADIUS)
    radiance = model.predicted()
    model = model.with_effect(Vignetting.of(context), np.array([-0.3, 0.1]))
    context = changed(context, model.predicted())
    model = replace(model, pixels=context.pixels, footprint=None)
    found = drained(correct_samples(table_of(context), context.pixels, model, context))
    brdf = PrincipalBRDF(context.brdfs.basis, context.brdfs.coefficients[0])
    return found, brdf, radiance


def test_true_brdf_predicts_every_photo_under_an_area_light(area_light_ball):
    """With the true BRDF, the held-out error of every photo under the area light is almost zero."""
    found, brdf, radiance = area_light_ball
    assert found.blur is not None
    rows = rows_of(found.table, lit_ball(7, GLOSSY))
    np.testing.assert_allclose(found.table.radiance, radiance[rows], rtol=2e-3, atol=1e-6)
    for photo in np.unique(found.table.photo):
        prediction = found.blur.predict_held_out(found.table, int(photo), brdf)
        assert prediction.squared_error < 1e-5 * prediction.size
        held_out_samples = found.table.select(found.table.photo == photo)
        assert prediction.size == pytest.approx(
            np.sum((held_out_samples.response * held_out_samples.radiance) ** 2), rel=1e-4
        )


def test_deconvolution_with_the_true_brdf_recovers_its_samples(area_light_ball):
    found, brdf, _ = area_light_ball
    deconvolved = found.blur.sharpened(found.table, brdf)
    truth = brdf.evaluate(deconvolved.angles)
    np.testing.assert_allclose(deconvolved.rho, truth, rtol=2e-3, atol=1e-5)
    assert len(deconvolved) > 0.9 * len(found.table)


def test_deconvolution_with_an_approximate_brdf_reduces_the_error(area_light_ball):
    """Deconvolution helps even if the BRDF used for it is only approximate."""
    found, brdf, _ = area_light_ball
    truth = brdf.evaluate(found.table.angles)
    near_peak = found.table.theta_h < np.radians(2)
    before = np.log(found.table.rho / truth)[near_peak]
    assert before.mean() < -0.1  # the blur darkens the centre of the highlight
    coefficients = brdf.coefficients.copy()
    coefficients[:, : brdf.basis.count] *= 0.9
    deconvolved = found.blur.sharpened(found.table, PrincipalBRDF(brdf.basis, coefficients))
    after = np.log(deconvolved.rho / brdf.evaluate(deconvolved.angles))[
        deconvolved.theta_h < np.radians(2)
    ]
    assert abs(after.mean()) < abs(before.mean())


def test_point_light_needs_no_deconvolution():
    context = lit_ball(7, GLOSSY)
    model = Model(context.pixels, MaterialBRDFs.of([_brdf(context)]))
    found = drained(correct_samples(table_of(context), context.pixels, model, context))
    assert found.blur is None


def _brdf(context) -> PrincipalBRDF:
    return PrincipalBRDF(context.brdfs.basis, context.brdfs.coefficients[0])


@pytest.mark.parametrize(
    ("errors", "passes", "required"),
    [
        ([0.10, 0.10], 0, False),  # no gain: the samples are not deconvolved
        ([0.10, 0.10, 0.10], 1, True),  # no gain, but the caller requires the first pass
        ([0.10, 0.07, 0.069], 1, False),  # a second pass only amplifies noise
        ([0.10, 0.07, 0.05, 0.06], 2, False),
        ([0.10, 0.08, 0.06, 0.05, 0.04], highlight_deconvolution_passes.MAX_PASSES, False),
        ([None, None], 1, False),  # a single photo has no held-out error
    ],
)
def test_passes_stop_when_the_held_out_error_stops_decreasing(errors, passes, required):
    tables = []

    class Blur:
        def sharpened(self, table, brdf):
            return f"{table} sharper than {brdf}"

        def predict_held_out(self, table, photo, brdf):
            raise AssertionError("nothing is fitted here")

    def fit_again(table, judge, start, share):
        # the first pass assumes a point light, the others the blur
        assert (judge is None) == (not tables)
        error = errors[len(tables)]
        tables.append(table)
        yield Step("", start + share)
        held_out_samples = (
            None if error is None else HeldOutErrors(error, error, {0: error, 1: 2 * error})
        )
        return SimpleNamespace(held_out=held_out_samples, fit=SimpleNamespace(brdf=len(tables) - 1))

    steps = fit_with_deconvolution(
        CorrectedSamples("samples", np.arange(0), {}, Blur()), fit_again, 0.2, 0.5, required
    )
    fractions = []
    while True:
        try:
            fractions.append(next(steps).fraction)
        except StopIteration as end:
            found, deconvolved = end.value
            break
    assert found.fit.brdf == passes and deconvolved == (passes > 0)
    assert tables == ["samples", *(f"samples sharper than {k}" for k in range(len(tables) - 1))]
    assert fractions == sorted(fractions) and fractions[-1] <= 0.7 + 1e-9
