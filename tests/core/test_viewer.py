"""The data of the viewer's page: tables, objects and skies."""

from __future__ import annotations

import base64
import json
import re

import numpy as np
import pytest

from patina.core.angles import Angles, cosines
from patina.core.appearance.principled import Principled
from patina.core.basis import mapping
from patina.core.errors import InputError
from patina.core.viewer import page
from patina.core.viewer.model_tables import INTERVAL_STEP, ViewerMaterial
from patina.core.viewer.photo_layers import PhotoLayers, page_data
from patina.core.viewer.skies import Sky, computed_skies
from patina.core.viewer.viewer_object import ViewerObject, simplified
from tests.projected import projected
from tests.sphere_mesh import sphere

MODEL = Principled(base_color=np.array([0.4, 0.1, 0.05]), roughness=0.3)


def test_tables_hold_the_brdf_within_the_rounding_of_half_floats():
    brdf = projected(MODEL.evaluate, 20)
    made = ViewerMaterial.of("red", brdf, {"principled": MODEL.evaluate})
    rng = np.random.default_rng(1)
    angles = Angles(*(rng.uniform(0, top, 2000) for top in (1.2, 1.2, np.pi)))
    lit = np.minimum(*cosines(*angles)) > 0.1
    angles = Angles(*(a[lit] for a in angles))
    table = made.tables["measured"].astype(np.float32)
    found = mapping.unlog_weighted(made.grid.interpolate(table, angles), mapping.cos_map(angles))
    assert found == pytest.approx(brdf.evaluate(angles), rel=0.005, abs=2e-5)
    assert made.tables["principled"].shape == table.shape
    assert made.interval is None


def test_the_interval_is_stored_to_two_per_cent():
    brdf = projected(MODEL.evaluate, 20)
    made = ViewerMaterial.of("red", brdf, {}, lambda a: np.full((len(a.theta_h), 3), 1.7))
    assert made.interval is not None
    assert np.exp(made.interval * INTERVAL_STEP) == pytest.approx(1.7, rel=0.01)


def test_an_object_is_upright_centred_and_seen_from_its_first_camera():
    points, faces = sphere(8)
    points = points * [1.0, 1.0, 3.0] + [5.0, 0.0, 2.0]  # long along z
    tilted = points[:, [2, 0, 1]]  # long along x, so that x is up
    eye = np.array([2.0, 5.0, 40.0])  # from its side
    made = ViewerObject.of(
        tilted, faces, np.zeros(len(faces), int), np.array([1.0, 0, 0]), seen_from=eye
    )
    extent = np.ptp(made.positions, axis=0)
    assert extent[2] == pytest.approx(3 * extent[0], rel=0.05)
    assert np.linalg.norm(made.positions, axis=1).max() == pytest.approx(1 / 1.02, rel=1e-5)
    # the point that is nearest to the camera is nearest to −y
    nearest = np.argmin(np.linalg.norm(tilted - eye, axis=1))
    assert made.positions[nearest, 1] == pytest.approx(made.positions[:, 1].min(), abs=0.02)


def test_parts_are_those_of_the_materials():
    points, faces = sphere(6)
    material = np.arange(len(faces)) % 2
    made = ViewerObject.of(points, faces, material)
    assert [part.material for part in made.parts] == [0, 1]
    assert sum(len(part.corners) for part in made.parts) == 3 * len(faces)


def test_a_large_mesh_is_simplified_without_leaving_its_surface():
    points, faces = sphere(120)
    fewer, kept, which = simplified(points, faces, most=9000)
    assert 3000 < len(kept) <= 9000
    assert len(which) == len(kept)
    assert np.linalg.norm(fewer[np.unique(kept)], axis=1) == pytest.approx(1.0, abs=0.02)
    area = np.linalg.norm(
        np.cross(*(fewer[kept[:, i]] - fewer[kept[:, 0]] for i in (1, 2))), axis=1
    )
    assert area.sum() / 2 == pytest.approx(4 * np.pi, rel=0.03)


@pytest.mark.parametrize("sky", computed_skies(), ids=lambda sky: sky.name)
def test_computed_skies_have_irradiance_pi_from_above(sky: Sky):
    assert irradiance(sky.radiance) == pytest.approx(np.pi, rel=0.01)


def test_reducing_a_sky_keeps_its_irradiance():
    rng = np.random.default_rng(0)
    large = rng.gamma(0.3, 2.0, (500, 1000, 3))
    reduced = Sky.reduced("noise", large).radiance
    assert reduced.shape == (96, 192, 3)
    assert irradiance(reduced) == pytest.approx(irradiance(large), rel=0.01)


def irradiance(radiance: np.ndarray) -> float:
    """On a surface that faces up, mean of the channels."""
    rows, columns = radiance.shape[:2]
    theta = np.pi * (np.arange(rows) + 0.5) / rows
    weight = np.sin(theta) * np.maximum(np.cos(theta), 0) * 2 * np.pi**2 / (rows * columns)
    return float(np.sum(radiance.mean(axis=2) * weight[:, None]))


def test_the_page_is_one_file_with_its_data(tmp_path, monkeypatch):
    program = tmp_path / "viewer.js"
    program.write_text("start('</script>')")
    monkeypatch.setattr(page, "PROGRAM", program)
    brdf = projected(MODEL.evaluate, 10)
    made = ViewerMaterial.of("</script><b>", brdf, {})
    page.write_viewer(tmp_path / "viewer.html", "<Jar & lid>", [made], computed_skies())
    text = (tmp_path / "viewer.html").read_text("utf-8")
    assert "&lt;Jar &amp; lid&gt;" in text
    assert not re.search(r"(src|href)\s*=|https?://", text.replace("http://www.w3.org", ""))
    assert text.count("</script>") == 2
    data = json.loads(text.split('id="patina-data">')[1].split("</script>")[0])
    table = np.frombuffer(
        base64.b64decode(data["materials"][0]["models"]["measured"]["table"]), "<f2"
    )
    assert np.array_equal(table.reshape(-1, 3), made.tables["measured"])
    assert data["materials"][0]["name"] == "</script><b>"


def test_without_its_program_there_is_no_page(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "PROGRAM", tmp_path / "missing.js")
    with pytest.raises(InputError, match=r"run\.py build"):
        page.write_viewer(tmp_path / "viewer.html", "a", [], [])
    assert not (tmp_path / "viewer.html").exists()


def test_a_stray_triangle_does_not_coarsen_an_object():
    points, faces = sphere(120)
    stray = np.array([[50.0, 0, 0], [50.1, 0, 0], [50.0, 0.1, 0]])
    more = np.arange(3)[None] + len(points)
    points, faces = np.concatenate([points, stray]), np.concatenate([faces, more])
    _, kept, _ = simplified(points, faces, most=9000)
    assert 3000 < len(kept) <= 9000


def test_photos_of_a_large_capture_are_thinned_evenly():
    picture = np.zeros((8, 8, 3), np.uint8)
    photos = [PhotoLayers(f"{k}", {"Photo": picture}, {}) for k in range(100)]
    names = [photo["name"] for photo in page_data(photos)["photos"]]
    assert len(names) == 40 and names[0] == "0" and names[-1] == "99"
    steps = np.diff([int(name) for name in names])
    assert set(steps) <= {2, 3}
    assert page_data([])["photos"] == []
