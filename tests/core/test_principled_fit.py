"""The Principled fit: it recovers its own model, beats a diffuse surface, and reports its error."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.appearance.cube_root import quadrature
from patina.core.appearance.principled import Principled
from patina.core.appearance.principled_fit import fit_principled
from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.errors import FitError

PARAMETER_SETS = [
    Principled(base_color=np.array([0.6, 0.1, 0.05]), roughness=0.3),
    Principled(base_color=np.array([0.9, 0.6, 0.2]), metallic=1.0, roughness=0.15),
    Principled(base_color=np.array([0.3, 0.4, 0.5]), roughness=0.8, specular_ior_level=0.2),
]


@pytest.mark.parametrize("truth", PARAMETER_SETS, ids=["glossy", "metal", "matte"])
def test_principled_parameters_are_recovered(truth):
    fit = fit_principled(truth.evaluate)
    found = fit.principled
    assert fit.error < 1e-3
    np.testing.assert_allclose(found.base_color, truth.base_color, atol=2e-3)
    assert found.metallic == pytest.approx(truth.metallic, abs=2e-3)
    assert found.roughness == pytest.approx(truth.roughness, abs=2e-3)
    assert found.coat_weight == 0
    if truth.metallic == 0:
        assert found.specular_ior_level == pytest.approx(truth.specular_ior_level, abs=0.01)


def test_coat_is_recovered():
    truth = Principled(
        base_color=np.array([0.2, 0.3, 0.6]), roughness=0.6, coat_weight=0.8, coat_roughness=0.08
    )
    fit = fit_principled(truth.evaluate)
    assert fit.start == "coated" and fit.error < 1e-3
    assert fit.principled.coat_weight == pytest.approx(0.8, abs=0.01)
    assert fit.principled.coat_roughness == pytest.approx(0.08, abs=0.002)
    assert fit_principled(truth.evaluate, coat=False).principled.coat_weight == 0


def test_mean_material_fits_better_than_diffuse_with_few_evaluations(monkeypatch):
    basis, evaluations = default_basis(), []
    once = Principled.at

    def counted(self, where):
        evaluations.append(1)
        return once(self, where)

    monkeypatch.setattr(Principled, "at", counted)
    fit = fit_principled(PrincipalBRDF(basis, np.zeros((3, 5))).evaluate)
    assert len(evaluations) < 3000  # a millisecond each
    assert fit.error < 0.5 * fit.diffuse_error
    assert fit.error < 0.2  # its lobe is not GGX
    assert set(fit.errors) >= {"diffuse", "glossy", "metal"}


def test_remaining_weight_lies_below_horizon():
    angles, weight = quadrature()
    assert 0.4 < weight.sum() < 1
    assert weight.min() > 0
    assert angles.theta_h.min() < np.radians(0.05)  # sharp lobes are resolved


def test_invalid_brdf_is_rejected():
    with pytest.raises(FitError):
        fit_principled(lambda angles: np.full((angles.theta_h.size, 3), np.nan))
