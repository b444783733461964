"""`diagnose` finds effects simulated in path-traced captures: a few cases of the table that
`run.py hunt` computes."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

from patina.core.capture import read_capture  # noqa: E402
from patina.core.jobs import FitJob  # noqa: E402
from patina.core.jobs.diagnose_job import DiagnoseJob  # noqa: E402
from patina.scene.material import material_nodes  # noqa: E402
from tools.hunt.make import CAPTURE, make  # noqa: E402

if material_nodes.osl_missing():
    pytest.skip(f"{material_nodes.osl_missing()}", allow_module_level=True)

CASES = {
    "none": (0.0, 5, "none"),
    "cast_shadow": (0.03, 1, "cast_shadow"),
    "moire": (0.03, 1, "unknown"),
    "anisotropy": (0.1, 2, "anisotropy"),  # its step is weaker than that of unrelated effects
}
"""Strength, seed, and the expected cause; moiré is not among the known causes."""
NIGHTLY = {"anisotropy"}


@pytest.mark.parametrize(
    "cause", [pytest.param(c, marks=[pytest.mark.nightly] * (c in NIGHTLY)) for c in CASES]
)
def test_simulated_cause_is_found(cause, tmp_path):
    strength, seed, expected_cause = CASES[cause]
    truth = make(tmp_path, cause, strength, seed)
    # the size of the effect is found on small photos, on which narrow highlights change less
    tolerance = 0.4 if cause == "anisotropy" else 0.2
    assert truth.strength == pytest.approx(strength, rel=tolerance)
    job = DiagnoseJob(FitJob(read_capture(tmp_path / CAPTURE), portable=False))
    job.drain()
    found = job.found
    assert (found.causes or ("none",)) == (expected_cause,)
    if not found.accepted:
        return
    assert found.held_out_after.mean < found.held_out_before.mean
    trial = found.accepted[0]
    if cause == "cast_shadow":
        darkness_error = trial.identified + truth.parameters["darkness"]
        assert (np.abs(darkness_error) < np.maximum(3 * trial.standard_errors, 0.03)).all()
    if cause == "vignetting":
        corner = trial.effect.gain(trial.x)[np.argmax(trial.effect.r2)]
        r2 = trial.effect.r2.max()
        tangent2 = (1 - truth.parameters["corner"]) ** -0.5 - 1
        assert corner == pytest.approx((1 + tangent2 * r2) ** -2, abs=0.03)
