"""Exported materials rendered by Mitsuba 3, compared with the prediction by numpy."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from patina.core.angles import half_difference
from patina.core.export import renderer_formats
from patina.core.export.subject import Subject
from patina.core.result import read_result
from patina.core.views.sphere import KEY
from tests import make_result as made

SIZE = 48
RENDER = """
import sys
import mitsuba as mi, numpy as np
mi.set_variant(sys.argv[1])
sys.path.insert(0, sys.argv[2])
if "rgb" in sys.argv[1]:
    import patina_bsdf
scene = mi.load_file(sys.argv[3], spp=int(sys.argv[6]), size=int(sys.argv[5]))
if sys.argv[7] == "constant":  # the same scene in a white room
    from xml.etree import ElementTree as ET
    tree = ET.parse(sys.argv[3])
    root = tree.getroot()
    root.remove(root.find("emitter"))
    room = ET.SubElement(root, "emitter", type="constant")
    ET.SubElement(room, "rgb", name="radiance", value="1")
    tree.write(sys.argv[3] + ".room.xml")
    scene = mi.load_file(sys.argv[3] + ".room.xml", spp=int(sys.argv[6]), size=int(sys.argv[5]))
np.save(sys.argv[4], np.array(mi.render(scene))[..., :3])
"""


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Subject]]:
    if importlib.util.find_spec("mitsuba") is None:
        pytest.skip("the mitsuba package is not installed")
    folder = tmp_path_factory.mktemp("mitsuba")
    subjects = [Subject(m) for m in read_result(made.two_materials(folder / "r")).materials]
    renderer_formats.write_mitsuba(folder, subjects)
    return folder, subjects


@pytest.fixture(scope="module")
def llvm(exported: tuple[Path, list[Subject]]) -> bool:
    """Whether Mitsuba finds an LLVM that it can compile with; with other versions it aborts."""
    folder, subjects = exported
    return start(folder, f"{subjects[0].id}.xml", "llvm_ad_rgb", "key", 4, 1).returncode == 0


def start(
    folder: Path, scene: str, variant: str, light: str, size: int, spp: int
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", RENDER, variant, folder, folder / scene, folder / "picture.npy",
         str(size), str(spp), light], capture_output=True, text=True, timeout=300,
    )  # fmt: skip


def render(folder: Path, scene: str, variant: str, light: str, size: int, spp: int) -> np.ndarray:
    done = start(folder, scene, variant, light, size, spp)
    assert done.returncode == 0, done.stderr[-2000:]
    return np.load(folder / "picture.npy")


def pixels(size: int, inner: float) -> tuple[np.ndarray, np.ndarray]:
    """(inside (h, w), normals (n, 3)) of pixel centres well within the sphere's disc."""
    axis = ((np.arange(size) + 0.5) / size * 2 - 1) * 1.05
    x, y = np.meshgrid(axis, -axis)
    inside = x**2 + y**2 < inner
    return inside, np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1)[inside]


def under_key(subject: Subject, normal: np.ndarray) -> np.ndarray:
    """Radiance of each point under the key light of irradiance π."""
    light, view = KEY / np.linalg.norm(KEY), np.array([0.0, 0.0, 1.0])
    cos = normal @ light
    lit = cos > 0
    found = np.zeros((len(normal), 3))
    angles = half_difference(normal[lit], light[None], np.broadcast_to(view, normal[lit].shape))
    found[lit] = np.pi * cos[lit, None] * subject.material.brdf.evaluate(angles)
    return found


def within_pixels(subject: Subject, size: int, inner: float, finer: int = 9) -> np.ndarray:
    """The mean over each pixel, as a box filter has it."""
    inside, _ = pixels(size, inner)
    axis = ((np.arange(size * finer) + 0.5) / (size * finer) * 2 - 1) * 1.05
    x, y = np.meshgrid(axis, -axis)
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 1e-9))
    normal = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    whole = np.repeat(np.repeat(inside, finer, 0), finer, 1).ravel()
    picture = np.zeros((size * finer * size * finer, 3))
    picture[whole] = under_key(subject, normal[whole])
    blocks = picture.reshape(size, finer, size, finer, 3).mean(axis=(1, 3))
    return blocks[inside]


def check_under_key(exported, variant: str, suffix: str, size: int, spp: int, most: float) -> None:
    folder, subjects = exported
    for subject in subjects:
        picture = render(folder, f"{subject.id}{suffix}.xml", variant, "key", size, spp)
        inside, _ = pixels(size, 0.9)
        expected = within_pixels(subject, size, 0.9)
        found = picture[inside]
        assert np.linalg.norm(found - expected) / np.linalg.norm(expected) < most
        # light from −x, above: checks left against right and up against down
        assert abs(found.mean() / expected.mean() - 1) < most


def test_plugin_rendering_matches_prediction(exported) -> None:
    """Within 2 % over all pixels, under a distant light; the variant that runs everywhere."""
    check_under_key(exported, "scalar_rgb", "", 16, 100, 0.02)


def test_fast_variant_matches_prediction(exported, llvm: bool) -> None:
    if not llvm:
        pytest.skip("no LLVM that Mitsuba's fast CPU variant can use")
    check_under_key(exported, "llvm_ad_rgb", "", 64, 256, 0.01)


def test_mitsuba_measured_plugin_matches_prediction(exported) -> None:
    """The tensor file, converted to wavelengths and back."""
    check_under_key(exported, "scalar_spectral", "_spectral", 32, 256, 0.02)


def test_furnace_albedo_matches_quadrature(exported, llvm: bool) -> None:
    """Directional albedo by Mitsuba's path tracer against a quadrature of the BRDF."""
    folder, subjects = exported
    inside, normal = pixels(8, 0.6)
    for subject in subjects:
        variant, spp = ("llvm_ad_rgb", 4096) if llvm else ("scalar_rgb", 144)
        picture = render(folder, f"{subject.id}.xml", variant, "constant", 8, spp)
        expected = albedo(subject, normal[:, 2])
        assert picture[inside].mean() == pytest.approx(expected.mean(), rel=0.02)


def albedo(subject: Subject, cos_view: np.ndarray) -> np.ndarray:
    """(n, 3) by a quadrature over half vectors: dω = 4 (v·h) sinθh dθh dφh."""
    u, phi = (np.arange(400) + 0.5) / 400, (np.arange(96) + 0.5) / 96 * 2 * np.pi
    theta = u[:, None] ** 2 * np.pi / 2
    half = np.stack(
        np.broadcast_arrays(
            np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
        ), axis=-1,
    ).reshape(-1, 3)  # fmt: skip
    step = np.broadcast_to(np.pi * u[:, None] / 400 * (2 * np.pi / 96), (400, 96)).ravel()
    area = np.sqrt(np.maximum(1 - half[:, 2] ** 2, 0)) * step
    out = []
    for cos in cos_view:
        view = np.array([np.sqrt(1 - cos**2), 0, cos])
        along = half @ view
        light = 2 * along[:, None] * half - view
        kept = (along > 0) & (light[:, 2] > 0)
        angles = half_difference(
            np.array([0.0, 0.0, 1.0]), light[kept], np.broadcast_to(view, light[kept].shape)
        )
        f = subject.material.brdf.evaluate(angles)
        weight = (light[:, 2] * 4 * along * area)[kept]
        out.append(weight @ f)
    return np.array(out)
