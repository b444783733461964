"""Highlights that a wide lamp blurs: predicted blurred, sharpened as far as unseen photos say."""

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

WIDE = np.array([np.radians(14.0)])


@pytest.fixture(scope="module")
def wide() -> tuple[CorrectedSamples, PrincipalBRDF, np.ndarray]:
    """Samples of a glossy ball under a wide lamp, by a lens that is darker at its edge, its BRDF,
    and the lamp's light that arrives (n, 3)."""
    context = lit_ball(7, GLOSSY)
    model = Model(context.pixels, context.brdfs).with_effect(AreaLight.of(context), WIDE)
    shown = model.predicted()
    model = model.with_effect(Vignetting.of(context), np.array([-0.3, 0.1]))
    context = changed(context, model.predicted())
    model = replace(model, pixels=context.pixels, footprint=None)
    found = drained(correct_samples(table_of(context), context.pixels, model, context))
    brdf = PrincipalBRDF(context.brdfs.basis, context.brdfs.coefficients[0])
    return found, brdf, shown


def test_what_a_wide_lamp_shows_is_predicted_of_every_photo(wide):
    """The true BRDF misses nothing of any photo under the lamp, and much as a point's."""
    found, brdf, shown = wide
    assert found.blur is not None
    rows = rows_of(found.table, lit_ball(7, GLOSSY))
    np.testing.assert_allclose(found.table.radiance, shown[rows], rtol=2e-3, atol=1e-6)
    for photo in np.unique(found.table.photo):
        judged = found.blur.predict_held_out(found.table, int(photo), brdf)
        assert judged.squared_error < 1e-5 * judged.size
        held = found.table.select(found.table.photo == photo)
        assert judged.size == pytest.approx(np.sum((held.response * held.radiance) ** 2), rel=1e-4)


def test_sharpened_with_the_true_brdf_the_samples_are_its(wide):
    found, brdf, _ = wide
    sharp = found.blur.sharpened(found.table, brdf)
    truth = brdf.evaluate(sharp.angles)
    np.testing.assert_allclose(sharp.rho, truth, rtol=2e-3, atol=1e-5)
    assert len(sharp) > 0.9 * len(found.table)


def test_a_pass_with_a_wider_highlight_comes_nearer(wide):
    """The BRDF of the pass need not be the true one."""
    found, brdf, _ = wide
    truth = brdf.evaluate(found.table.angles)
    inner = found.table.theta_h < np.radians(2)
    before = np.log(found.table.rho / truth)[inner]
    assert before.mean() < -0.1  # the blur takes from the highlight's middle
    coefficients = brdf.coefficients.copy()
    coefficients[:, : brdf.basis.count] *= 0.9
    once = found.blur.sharpened(found.table, PrincipalBRDF(brdf.basis, coefficients))
    after = np.log(once.rho / brdf.evaluate(once.angles))[once.theta_h < np.radians(2)]
    assert abs(after.mean()) < abs(before.mean())


def test_nothing_is_sharpened_under_a_point():
    context = lit_ball(7, GLOSSY)
    model = Model(context.pixels, MaterialBRDFs.of([_brdf(context)]))
    found = drained(correct_samples(table_of(context), context.pixels, model, context))
    assert found.blur is None


def _brdf(context) -> PrincipalBRDF:
    return PrincipalBRDF(context.brdfs.basis, context.brdfs.coefficients[0])


@pytest.mark.parametrize(
    ("errors", "taken", "exactly"),
    [
        ([0.10, 0.10], 0, False),  # nothing gained: as the photos show it
        ([0.10, 0.10, 0.10], 1, True),  # unless somebody asked for it
        ([0.10, 0.07, 0.069], 1, False),  # a second pass sharpens noise
        ([0.10, 0.07, 0.05, 0.06], 2, False),
        ([0.10, 0.08, 0.06, 0.05, 0.04], highlight_deconvolution_passes.MAX_PASSES, False),
        ([None, None], 1, False),  # of one photo nothing is unseen
    ],
)
def test_passes_end_where_unseen_photos_gain_no_more(errors, taken, exactly):
    tables = []

    class Blur:
        def sharpened(self, table, brdf):
            return f"{table} sharper than {brdf}"

        def predict_held_out(self, table, photo, brdf):
            raise AssertionError("nothing is fitted here")

    def again(table, judge, start, share):
        assert (judge is None) == (not tables)  # the first as a point's, the others blurred
        error = errors[len(tables)]
        tables.append(table)
        yield Step("", start + share)
        held = None if error is None else HeldOutErrors(error, error, {0: error, 1: 2 * error})
        return SimpleNamespace(held_out=held, fit=SimpleNamespace(brdf=len(tables) - 1))

    steps = fit_with_deconvolution(
        CorrectedSamples("samples", {}, Blur()), again, 0.2, 0.5, exactly
    )
    fractions = []
    while True:
        try:
            fractions.append(next(steps).fraction)
        except StopIteration as end:
            found, sharp = end.value
            break
    assert found.fit.brdf == taken and sharp == (taken > 0)
    assert tables == ["samples", *(f"samples sharper than {k}" for k in range(len(tables) - 1))]
    assert fractions == sorted(fractions) and fractions[-1] <= 0.7 + 1e-9
