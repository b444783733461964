"""The museum's bronze: its flash stands above and beside the lens, and the capture says at it."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.capture import read_capture
from patina.core.diagnose import effects
from patina.core.jobs import FitJob, finished
from patina.core.jobs.diagnose_job import DiagnoseJob
from patina.core.jobs.select_photos import select_photos
from tools import real_captures

pytestmark = pytest.mark.slow

EVERY = 2  # photos; half of them are enough, and take half of the time
RIVALS = {
    "light_direction", "near_light", "light_intensity", "camera_response", "vignetting",
    "camera_pose", "cast_shadow", "environment_reflection", "normal_error",
}  # fmt: skip
"""Causes that were named instead, or look similar. `run.py bench diagnose` tests all, with all
photos."""
RIGHT, ABOVE = (0.0, 0.4), (0.5, 0.9)
"""Scan units from the lens: the range that ../shared/real.md states, and 0.1 to 0.15 more."""


def test_the_flash_of_the_bronze_is_found(shared, tmp_path, monkeypatch):
    tested = [kind for kind in effects.EFFECTS if kind.cause in RIVALS | {"flash_offset"}]
    assert {kind.cause for kind in tested} == RIVALS | {"flash_offset"}
    monkeypatch.setattr(effects, "EFFECTS", tuple(tested))
    path = real_captures.rodin(shared / "data", tmp_path, chart=False, refine=False)
    capture = read_capture(path)
    capture = select_photos(capture, range(0, len(capture.photos), EVERY))
    job = DiagnoseJob(FitJob(capture, portable=False))
    job.drain()
    found = finished(job.found)
    assert found.causes[0] == "flash_offset", found.causes
    assert not {"cast_shadow", "environment_reflection"} & set(found.causes)
    trial = found.accepted[0]
    right, down, _ = trial.identified
    error = 2 * np.asarray(trial.standard_errors)
    assert RIGHT[0] - error[0] < right < RIGHT[1] + error[0]
    assert ABOVE[0] - error[1] < -down < ABOVE[1] + error[1]
    assert found.error_after.photos < found.error_before.photos - 0.01
