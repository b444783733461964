"""scene.blend of `diagnose` shows the check in the sidebar, and colours the mesh."""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

import bpy  # noqa: E402

import patina  # noqa: E402
from patina.core.capture import read_capture  # noqa: E402
from patina.core.concurrency.job import finished  # noqa: E402
from patina.core.jobs import FitJob  # noqa: E402
from patina.core.jobs.check_job import CheckJob  # noqa: E402
from patina.core.report.diagnosis_json import CheckRecord, describe  # noqa: E402
from patina.scene.export.blend_file import write_blend  # noqa: E402
from patina.scene.export.open_blend import open_blend  # noqa: E402
from patina.scene.scan.evidence_colours import RESIDUAL  # noqa: E402
from patina.scene.session.scene_properties import (  # noqa: E402
    DIAGNOSIS,
    capture_path,
    stored_result,
)
from tests import make_capture as made  # noqa: E402


@pytest.fixture(autouse=True)
def registered():
    patina.register()
    yield
    patina.unregister()


def test_the_check_is_stored(tmp_path):
    capture = read_capture(made.make_capture(tmp_path / "capture", photos=4))
    job = CheckJob(FitJob(capture), pixels=1500)
    job.drain()
    checked, after = job.checked, finished(job.result)
    found, before = finished(checked.found), finished(checked.result)
    description = describe(found, finished(checked.assessment), before, after)
    record = CheckRecord(description, found, finished(checked.context))
    blend = tmp_path / "scene.blend"
    write_blend(blend, blend, after, job.stages, record)
    open_blend(blend)
    scene = bpy.context.scene
    stored = stored_result(capture_path(scene), DIAGNOSIS)
    assert stored["scan_quality"]["sentence"] == found.quality.sentence()
    assert any(one.name.endswith(RESIDUAL) for one in scene.patina.mesh.data.attributes)
    for figure in ("Poses", "Material"):
        assert bpy.ops.patina.explain_scan_quality(figure=figure) == {"FINISHED"}
