"""The command line: results, exit codes, one-line errors, no partial files."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from patina.core.angles import Angles
from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.brdf import TabulatedBRDF, merl_file
from tests import make_capture as made

pytestmark = pytest.mark.blender


def headless(root: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, root / "headless.py", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made.make_capture(tmp_path_factory.mktemp("ball"), photos=3)


@pytest.fixture(scope="module")
def fitted(root: Path, ball: Path) -> Path:
    out = ball.parent / "out"
    out.mkdir()
    (out / "mine.txt").write_text("kept")
    (out / "report").mkdir()
    (out / "report" / "notes.txt").write_text("kept")
    done = headless(root, "fit", ball, "--out", out)
    assert done.returncode == 0, done.stderr
    assert "[" in done.stderr and "surface" in done.stdout
    return out


def test_fit_writes_exactly_the_documented_files(fitted: Path) -> None:
    names = {p.name for p in fitted.iterdir()}
    exr = {
        name
        for name in names
        if name.startswith(("patina_components_", "patina_brdf_", "patina_sampling_"))
    }
    assert len(exr) == 3
    assert names - exr == {
        "result.json", "surface.binary", "scene.blend", "report", "mine.txt", ".patina-files",
    }  # fmt: skip
    assert (fitted / "report" / "index.html").is_file()
    assert (fitted / "report" / "notes.txt").read_text() == "kept"


def test_binary_file_holds_brdf_of_coefficients(fitted: Path) -> None:
    result = json.loads((fitted / "result.json").read_text())
    coefficients = np.array(result["materials"][0]["coefficients"])
    assert result["basis"]["version"] == default_basis().version
    table = merl_file.read(fitted / "surface.binary")
    # at a cell's centre, as docs say: θh = 90°·((ih+½)/90)², θd = id+½°, φd = ip+½°
    ih, idx, ip = 20, 33, 120
    angles = Angles(
        np.radians([90 * ((ih + 0.5) / 90) ** 2]),
        np.radians([idx + 0.5]),
        np.radians([ip + 0.5]),
    )
    expected = PrincipalBRDF(default_basis(), coefficients).evaluate(angles)[0]
    assert np.allclose(table.values[:, ih, idx, ip], expected, rtol=1e-4)


def test_blend_opens_with_complete_scene(fitted: Path) -> None:
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(fitted / "scene.blend"))
    for image in bpy.data.images:
        assert Path(bpy.path.abspath(image.filepath)).is_file(), image.filepath
        assert ".patina-part" not in image.filepath
    material = bpy.data.materials["surface"]
    node = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeScript")
    for socket in ("components", "remainder"):
        assert Path(node.inputs[socket].default_value).parent == fitted
    assert bpy.context.scene.camera is not None
    assert "Patina result" in bpy.data.texts


def test_same_input_gives_same_coefficients(
    root: Path, ball: Path, fitted: Path, tmp_path: Path
) -> None:
    done = headless(root, "fit", ball, "--out", tmp_path / "again")
    assert done.returncode == 0
    assert (tmp_path / "again" / "surface.binary").read_bytes() == (
        fitted / "surface.binary"
    ).read_bytes()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("lit_2.exr", "gone.exr"), r"ball\.capture\.toml:\d+: \[photo 2\.file\]"),
        (("view_03.jpg", "view_77.jpg"), r"\[photo 3\.camera\].*view_77"),
        (('name = "lamp1"', 'nme = "lamp1"'), r"\[light 1\.name\].*missing"),
    ],
)
def test_user_error_is_one_line_and_leaves_no_files(
    root: Path, ball: Path, tmp_path: Path, change: tuple[str, str], message: str
) -> None:
    broken = ball.with_name("broken.capture.toml")
    broken.write_text(ball.read_text().replace(*change).replace("ball.capture", "broken.capture"))
    before = sorted(p.name for p in ball.parent.iterdir())
    done = headless(root, "fit", broken, "--out", tmp_path / "out")
    assert done.returncode == 2
    error_lines = [line for line in done.stderr.splitlines() if not line.startswith("[")]
    assert len(error_lines) == 1 and "Traceback" not in done.stderr
    assert re.search(message.replace("ball", "broken"), error_lines[0]), error_lines[0]
    assert list(tmp_path.iterdir()) == []
    assert sorted(p.name for p in ball.parent.iterdir()) == before


def test_truncated_binary_and_wrong_usage_are_rejected(
    root: Path, fitted: Path, tmp_path: Path
) -> None:
    short = tmp_path / "short.binary"
    short.write_bytes((fitted / "surface.binary").read_bytes()[:-9])
    done = headless(root, "compare", short, fitted / "surface.binary")
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert "short.binary" in done.stderr and "truncated" in done.stderr
    assert headless(root, "nonsense").returncode == 2
    wrong = headless(root, "fit", fitted / "nothing.toml", "--out", fitted / "mine.txt")
    assert wrong.returncode == 2


def test_compare_of_equal_files_is_zero(root: Path, fitted: Path) -> None:
    done = headless(root, "compare", fitted / "surface.binary", fitted / "surface.binary")
    assert done.returncode == 0 and done.stdout.count("0.0000") == 3


def test_import_writes_one_blend(root: Path, ball: Path, tmp_path: Path) -> None:
    done = headless(root, "import", ball, "--out", tmp_path / "scan.blend")
    assert done.returncode == 0, done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["scan.blend"]


def test_import_of_genuine_models_without_a_mesh(root: Path, shared: Path, tmp_path: Path) -> None:
    models = shared / "data" / "cameras" / "colmap"
    for name, count in (("own_brighton_OPENCV_txt", 18), ("sbcv_SceauxCastle_bin", 11)):
        done = headless(root, "import", models / name, "--out", tmp_path / f"{name}.blend")
        assert done.returncode == 0, done.stderr
        assert f"{count} cameras" in done.stdout


def test_distorted_scan_imports_rectified_photos(root: Path, tmp_path: Path) -> None:
    path = made.make_capture(tmp_path / "ball", photos=2)
    lens = [made.FOCAL, *made.PRINCIPAL, -0.05]
    made.write_colmap(path.parent / "sparse", 2, model="SIMPLE_RADIAL", params=lens)
    (tmp_path / "elsewhere").mkdir()
    done = headless(root, "import", path, "--out", tmp_path / "elsewhere" / "scan.blend")
    assert done.returncode == 0, done.stderr
    found = sorted(p.name for p in (tmp_path / "elsewhere" / "rectified").iterdir())
    assert [name[:16] for name in found] == ["lit_1_rectified_", "lit_2_rectified_"]


def test_mask_error_names_material(root: Path, ball: Path, tmp_path: Path) -> None:
    text = ball.read_text().replace(
        'light = "lamp1"\n', 'light = "lamp1"\nmasks = {tin = "m.png"}\n', 1
    )
    broken = ball.with_name("masked.capture.toml")
    broken.write_text(text + '\n[[material]]\nname = "tin"\n')
    made.write_png(ball.parent / "m.png", np.zeros((made.HEIGHT, made.WIDTH)))
    done = headless(root, "fit", broken, "--out", tmp_path / "out")
    assert done.returncode == 2 and "all pixels are masked" in done.stderr
    assert not (tmp_path / "out").exists()


def test_compare_of_constant_table_gives_known_error(root: Path, tmp_path: Path) -> None:
    for name, value in (("a", 0.4), ("b", 0.5)):
        flat = TabulatedBRDF.from_function(lambda x, v=value: np.full((len(x.theta_h), 3), v))
        merl_file.write(tmp_path / f"{name}.binary", flat)
    done = headless(root, "compare", tmp_path / "a.binary", tmp_path / "b.binary")
    assert re.search(r"relative L2 .* 0\.2000", done.stdout)
