"""The whole pipeline: photos → fit → the scan with its material as GLB and USD."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from tests import make_capture as made
from tests.make_result import subjects

pytestmark = pytest.mark.blender


def headless(root: Path, *arguments: object) -> None:
    done = subprocess.run(
        [sys.executable, root / "headless.py", *map(str, arguments)],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_fit_is_exported_with_its_mesh(root: Path, tmp_path: Path) -> None:
    capture = made.make_capture(tmp_path / "ball", photos=3)
    headless(root, "fit", capture, "--out", tmp_path / "fit")
    before = sorted(p.name for p in (tmp_path / "fit").iterdir())
    headless(root, "material", tmp_path / "fit", "--to", "gltf", "usd", "--out", tmp_path / "out")
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert names == {"scan.glb", "scan.usdc", "losses.txt", "losses.json"}
    assert sorted(p.name for p in (tmp_path / "fit").iterdir()) == before
    raw = (tmp_path / "out" / "scan.glb").read_bytes()
    gltf = json.loads(raw[20 : 20 + struct.unpack_from("<I", raw, 12)[0]])
    fitted = json.loads((tmp_path / "fit" / "result.json").read_text("utf-8"))["materials"][0]
    material = gltf["materials"][0]
    assert material["name"] == fitted["name"] == "surface"
    (subject,) = subjects(tmp_path / "fit")
    assert material["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx(
        subject.gltf.principled.base_color, abs=1e-4
    )
    primitive = gltf["meshes"][0]["primitives"][0]
    assert primitive["material"] == 0
    assert gltf["accessors"][primitive["indices"]]["count"] > 1000
    # one material of several, or a result that has lost its scene: preview spheres
    (tmp_path / "fit" / "scene.blend").unlink()
    headless(root, "material", tmp_path / "fit", "--to", "gltf", "--out", tmp_path / "bare")
    assert (tmp_path / "bare" / "materials.glb").is_file()
