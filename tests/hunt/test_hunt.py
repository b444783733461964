"""Effects hidden in path-traced captures, and whether `diagnose` names them: a few of the table
that `run.py hunt` makes."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

from patina.core.capture import read_capture  # noqa: E402
from patina.core.job import FitJob  # noqa: E402
from patina.core.job.diagnose_job import DiagnoseJob  # noqa: E402
from patina.scene import materials  # noqa: E402
from tools.hunt.make import make  # noqa: E402

if materials.osl_missing():
    pytest.skip(f"{materials.osl_missing()}", allow_module_level=True)

CASES = {"none": (0.0, 5), "vignetting": (0.03, 2)}


@pytest.mark.parametrize("cause", CASES)
def test_what_is_hidden_is_named(cause, tmp_path):
    strength, seed = CASES[cause]
    truth = make(tmp_path, cause, strength, seed)
    assert truth.strength == pytest.approx(strength, rel=0.2)
    job = DiagnoseJob(FitJob(read_capture(tmp_path / "hunt.capture.toml")))
    job.drain()
    found = job.found
    assert (found.causes or ("none",)) == (cause,)
    if cause == "none":
        return
    assert found.unseen_after.mean < found.unseen_before.mean
    trial = found.accepted[0]
    corner = trial.effect.gain(trial.x)[np.argmax(trial.effect.r2)]
    r2 = trial.effect.r2.max()
    tangent2 = (1 - truth.numbers["corner"]) ** -0.5 - 1
    assert corner == pytest.approx((1 + tangent2 * r2) ** -2, abs=0.03)
