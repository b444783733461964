"""`material RESULT --to …`: output files, exit codes, one-line errors, no partial files."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from patina.commands import material
from patina.core.errors import InputError
from patina.core.export import material_formats
from tests import make_result as made

pytestmark = pytest.mark.blender


def headless(root: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, root / "headless.py", "material", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made.two_materials(tmp_path_factory.mktemp("result"))


def test_several_formats_at_once(root: Path, result: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "mine.txt").write_text("kept")
    done = headless(
        root, result, "--to", "binary", "mtlx", "pbrt", "mitsuba", "--material", "old rug",
        "--out", out,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert {p.name for p in out.iterdir()} == {
        "mine.txt", "losses.txt", "losses.json", "old rug.binary", "old_rug.mtlx", "old_rug.pbrt",
        "old_rug.bsdf", "old_rug.xml", "old_rug_spectral.xml", "old_rug_mitsuba.npz",
        "patina_bsdf.py", "render.py",
    }  # fmt: skip
    losses = json.loads((out / "losses.json").read_text("utf-8"))["losses"]
    assert [loss["format"] for loss in losses] == ["binary", "mtlx", "pbrt", "mitsuba"]
    for loss in losses:
        assert loss["material"] == "old rug" and loss["errors"]
        assert all((out / file).is_file() for file in loss["files"])
        for what, error in loss["errors"].items():
            assert 0 <= error < np.inf and what in done.stdout
    assert (result / "result.json").is_file() and len(list(result.iterdir())) == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["--to", "png"], "invalid choice"), (["--to", "exr", "--material", "gold"], "old rug")],
)
def test_invalid_arguments_give_one_line_error(root, result, tmp_path, arguments, message) -> None:
    done = headless(root, result, *arguments, "--out", tmp_path / "out")
    assert done.returncode == 2
    assert message in done.stderr and len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_invalid_destinations_are_rejected_before_any_work(result: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    for source, out in (
        (tmp_path / "nothing", tmp_path / "out"),
        (tmp_path / "file", tmp_path / "out"),
        (result, tmp_path / "file"),
        (result, result),
    ):
        namespace = argparse.Namespace(result=source, to=["binary"], out=out, material=None)
        with pytest.raises(InputError) as raised:
            material.run(namespace)
        assert "\n" not in str(raised.value)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file"]
    assert [p.name for p in result.iterdir()] == ["result.json"]


def test_failed_run_leaves_no_files(result: Path, tmp_path: Path, monkeypatch) -> None:
    def fails(folder: Path, subjects: object) -> None:
        (folder / "half.bsdf").write_bytes(b"half")
        raise OSError("no space left")

    monkeypatch.setitem(material_formats.PLAIN, "pbrt", fails)
    namespace = argparse.Namespace(
        result=result, to=["binary", "pbrt"], out=tmp_path / "out", material=["bronze"]
    )
    with pytest.raises(InputError, match="no space left"):
        material.run(namespace)
    assert list(tmp_path.iterdir()) == []


def test_blend_contains_assets_that_render(root: Path, result: Path, tmp_path: Path) -> None:
    done = headless(root, result, "--to", "blend", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / "materials.blend"))
    for name in ("bronze", "old rug"):
        made_of = bpy.data.materials[name]
        assert made_of.asset_data is not None and name in bpy.data.objects
        for node in made_of.node_tree.nodes:
            if node.bl_idname == "ShaderNodeScript":
                file = Path(node.inputs["components"].default_value)
                assert file.parent == tmp_path / "out" and file.is_file()
    assert not list((tmp_path / "out").glob("*.blend1"))
