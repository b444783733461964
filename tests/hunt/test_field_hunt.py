"""The captures of `run.py hunt --field`: their errors are those of scans, their effects are as
large as requested, and their photos agree with Patina's angles without using them."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

from patina.core.angles import half_difference  # noqa: E402
from patina.core.capture import read_capture  # noqa: E402
from patina.core.diagnose.effects import EFFECTS  # noqa: E402
from patina.core.inputs import capture_data  # noqa: E402
from patina.core.scan import Mesh  # noqa: E402
from tools.demo_shape import Surface, vertex_normals  # noqa: E402
from tools.experiments import mesh_error  # noqa: E402
from tools.field_hunt import make, real_sets, scans, table  # noqa: E402
from tools.field_hunt.judged import FieldRow, judged  # noqa: E402
from tools.field_hunt.renderer import half_angles  # noqa: E402
from tools.hunt.shape import lumpy  # noqa: E402

MAX_STANDARD_ERRORS = 5.0  # of a parameter, in standard errors that include the model's errors
MAX_BRDF_RATIO = 2.0  # of the error of the second fit to that of a fit without the effect


def test_angles_are_those_of_the_definition():
    rng = np.random.default_rng(0)
    n, light, view = rng.normal(size=(3, 500, 3))
    for one in (n, light, view):
        one /= np.linalg.norm(one, axis=1, keepdims=True)
    ours, patinas = half_angles(n, light, view), half_difference(n, light, view)
    assert ours.theta_h == pytest.approx(patinas.theta_h, abs=1e-6)
    assert ours.theta_d == pytest.approx(patinas.theta_d, abs=1e-6)
    # measured materials are the same on both sides of the plane of incidence
    away = np.abs(np.cos(ours.phi_d)) - np.abs(np.cos(patinas.phi_d))
    assert np.abs(away).max() < 1e-5


def test_a_simulated_scan_has_the_errors_of_stereo():
    rough = lumpy(3, subdivisions=5)
    points = scans._normalised(rough.points)[0]
    exact = Surface(points, rough.triangles, vertex_normals(points, rough.triangles))
    mesh = scans.stereo_like(exact, np.random.default_rng(1))
    true = Mesh(exact.points, exact.triangles.astype(np.int32))
    error = mesh_error.normal_errors(mesh.vertices, true)
    assert np.median(error) == pytest.approx(0.85, abs=0.1)
    assert 2.5 < np.percentile(error, 95) < 5.0


def test_every_effect_is_a_cause():
    known = {kind.cause for kind in EFFECTS}
    hidden = {cause for makers in make.MAKERS.values() for cause in makers}
    assert hidden | set(real_sets.EFFECTS) <= known


@pytest.mark.parametrize(("cause", "seed"), [("camera_response", 12), ("flash_offset", 3)])
def test_an_effect_is_as_large_as_requested(cause, seed, shared, tmp_path):
    truth = make.make(tmp_path, cause, 0.1, seed)
    assert truth.strength == pytest.approx(0.1, rel=0.2)
    capture = read_capture(tmp_path / make.CAPTURE)
    scan = capture_data.open_scan(capture)
    capture_data.check_photos(capture, scan)
    assert len(capture.photos) == 8
    assert "truth" not in (tmp_path / make.CAPTURE).read_text()


def test_an_effect_is_hidden_in_real_photographs(shared, tmp_path):
    truth = real_sets.make_real(tmp_path, "grey_sphere", "vignetting", 0.1, 0)
    assert truth.strength == pytest.approx(0.1, rel=0.2)
    capture = read_capture(tmp_path / make.CAPTURE)
    capture_data.check_photos(capture, capture_data.open_scan(capture))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cause", "seed"),
    [
        ("none", 3),
        # test_bronze.py finds that of a real capture
        pytest.param("flash_offset", 3, marks=pytest.mark.nightly),
        ("clipping", 3),
    ],
)
def test_hidden_effects_are_named_on_scans_as_they_are(cause, seed, shared):
    """A seeded part of the field hunt: the hidden effect and nothing else, at 10 % of the light."""
    row = judged("simulated", cause, 0.0 if cause == "none" else 0.1, seed)
    assert row.right_first and row.right_set, row.named
    # the errors of one capture are correlated, so coverage is counted over the whole table
    assert max(map(abs, row.off), default=0.0) < MAX_STANDARD_ERRORS, row.off
    assert row.brdf is None or row.brdf < MAX_BRDF_RATIO


def test_counts_of_the_table():
    def row(cause: str, named: tuple[str, ...]) -> FieldRow:
        return FieldRow(
            cause, 0.1 if cause != "none" else 0.0, 1, "simulated", "near", "jar", "paper", "exr",
            False, 0.1, named, (), (0.2, 0.1), 60.0, off=(0.5, 3.0), brdf=1.2,
        )  # fmt: skip

    right = row("near_light", ("near_light", "unknown"))
    beside = row("near_light", ("near_light", "cast_shadow"))
    wrong = row("none", ("cast_shadow",))
    honest = row("none", ("outside_basis", "unknown"))
    assert right.right_first and right.right_set
    assert beside.right_first and not beside.right_set
    assert not wrong.right_first and honest.right_first and honest.right_set
    text = table.table([right, beside, wrong, honest])
    assert "| simulated, effect of 10 % | 2 of 2 | 1 of 2 |" in text
    assert "| simulated, nothing hidden | 1 of 2 | 1 of 2 |" in text
    assert "4 of 8 parameters are in their 95 % interval" in text
    assert "median 1.20, worst decile 1.20" in text
