"""Maps of a painted surface photographed by Cycles, compared with the painted values."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

import bpy  # noqa: E402

from patina.core.capture import read_capture  # noqa: E402
from patina.core.errors import InputError  # noqa: E402
from patina.core.geometry import RayScene  # noqa: E402
from patina.core.inputs import capture_data  # noqa: E402
from patina.core.maps import MapsJob, MapsSettings, rasterise  # noqa: E402
from patina.core.maps.write import base_color, roughness, write_maps  # noqa: E402
from patina.core.result import read_result  # noqa: E402
from tests.wheel import maps_scene  # noqa: E402

SIZE = 256


def headless(root: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, root / "headless.py", *map(str, arguments)],
        capture_output=True, text=True, timeout=600,
    )  # fmt: skip


@pytest.fixture(scope="module")
def painted(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the capture and its photos, the result of its fit in "fit", and the maps in
    "maps".
    """
    folder = tmp_path_factory.mktemp("painted")
    maps_scene.photograph(folder)
    capture = maps_scene.write_scan(folder)
    done = headless(root, "fit", capture, "--out", folder / "fit")
    assert done.returncode == 0, done.stderr
    done = headless(
        root, "maps", capture, folder / "fit", "--out", folder / "maps", "--size", 128,
        "--format", "png",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder


def run_maps_job(folder: Path, capture: str = "painted.capture.toml", size: int = SIZE, **more):
    """Maps by the fit on paint-corrected samples that the command saved."""
    fitted = read_result(folder / "maps")
    job = MapsJob(read_capture(folder / capture), fitted, MapsSettings(size, refits=0), **more)
    job.drain()
    assert job.result is not None
    return job.result


@pytest.fixture(scope="module")
def result(painted: Path):
    return run_maps_job(painted)


def resolved(texels) -> np.ndarray:
    """(n,) texels away from the poles, where the paint is finer than the pixels of any photo."""
    _, v = maps_scene.centres(texels.size)
    v = v.ravel()[texels.place]
    ball = v > maps_scene.BALL_LOW
    low = np.where(ball, maps_scene.BALL_LOW, 0.02)
    high = np.where(ball, maps_scene.BALL_HIGH, maps_scene.BODY_TOP)
    return np.sin(np.pi * np.clip((v - low) / (high - low), 0, 1)) > 0.25


def truth(texels) -> np.ndarray:
    u, v = maps_scene.centres(texels.size)
    return maps_scene.base_color(u, v).reshape(-1, 3)[texels.place]


def relative_rms(found, expected) -> float:
    return float(np.sqrt(np.mean((found - expected) ** 2) / np.mean(expected**2)))


def visibility(scan, texels) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """((photos, n) cos θi where the camera sees the texel, else 0; (photos, n) whether another part
    shadows it; (n, 3) points), computed without the code under test.
    """
    rays = RayScene.build(scan.mesh)
    points, normals = texels.points(scan.mesh, slice(None)), texels.normals(scan.mesh, slice(None))
    start = points + 2e-3 * normals
    cosine, shaded = [], []
    for rotation, translation, light in maps_scene.shots():
        eye = -rotation.T @ translation
        away = eye - points
        distance = np.linalg.norm(away, axis=1)
        view = away / distance[:, None]
        seen = np.einsum("ij,ij->i", view, normals) > 0.1
        seen &= ~rays.occluded(start, view, distance)
        along = np.broadcast_to(light, points.shape)
        cosine.append(np.where(seen, np.maximum(normals @ light, 0), 0))
        shaded.append(rays.occluded(start, along))
    return np.array(cosine), np.array(shaded), points


def naive_albedo(folder: Path, points, cosine) -> np.ndarray:
    """(n, 3) mean of π L / (E cos θi) over the photos that see a texel facing the light."""
    total, count = np.zeros((len(points), 3)), np.zeros(len(points))
    for i, (rotation, translation, _) in enumerate(maps_scene.shots()):
        here = points @ rotation.T + translation
        x = maps_scene.FOCAL * here[:, 0] / here[:, 2] + maps_scene.WIDTH / 2
        y = maps_scene.FOCAL * here[:, 1] / here[:, 2] + maps_scene.HEIGHT / 2
        photo = maps_scene.photo(folder, i)
        good = (cosine[i] > 0.1) & (x >= 0) & (x < maps_scene.WIDTH)
        good &= (y >= 0) & (y < maps_scene.HEIGHT)
        shown = photo[y[good].astype(int), x[good].astype(int)]
        total[good] += np.pi * shown / (maps_scene.IRRADIANCE * cosine[i][good, None])
        count[good] += 1
    return total / np.maximum(count, 1)[:, None]


def test_base_colour_matches_painted_colour(painted, result):
    expected, found = truth(result.texels), base_color(result, 0)
    well = (result.maps.photos >= 3) & resolved(result.texels)
    assert well.mean() > 0.25
    error = relative_rms(found[well], expected[well])
    cosine, _, points = visibility(result.scan, result.texels)
    plain = relative_rms(naive_albedo(painted, points, cosine)[well], expected[well])
    print(f"base colour {error:.4f}, plain way {plain:.4f}, well-seen {well.mean():.2f}")
    assert error < 0.05
    assert plain > 3 * error


def test_fit_on_paint_corrected_samples_predicts_better(painted):
    first, again = (
        json.loads((painted / name / "result.json").read_text())["materials"][0]["held_out"]
        for name in ("fit", "maps")
    )
    assert first["typical"] > 0.2 > 4 * again["typical"]


def test_stated_error_matches_actual_error(result):
    expected, found = truth(result.texels), base_color(result, 0)
    level = expected.mean(axis=1)
    off = np.abs(found.mean(axis=1) - level) / level
    well = (result.maps.photos >= 2) & resolved(result.texels)
    # nine of ten errors within twice the stated one, and the stated error is not overcautious
    assert np.quantile(off[well] / result.maps.error[well], 0.9) < 2.0
    assert np.median(result.maps.error[well]) < 4 * np.median(off[well])
    unobserved = result.maps.photos == 0
    assert np.median(result.maps.error[unobserved]) > 2 * np.median(result.maps.error[well])


def test_cast_shadows_are_not_baked_in(painted, result):
    cosine, shaded, points = visibility(result.scan, result.texels)
    facing = cosine > 0.2
    cast = (facing & shaded).sum(axis=0) >= 1
    still = (facing & ~shaded).sum(axis=0) >= 2
    some = cast & still & (result.maps.photos >= 2) & resolved(result.texels)
    assert some.sum() > 300
    expected, found = truth(result.texels)[some], base_color(result, 0)[some]
    plain = naive_albedo(painted, points, cosine)[some]
    # a baked shadow is a dark bias; the mean of the paint is kept
    assert abs(found.mean() / expected.mean() - 1) < 0.03
    assert plain.mean() / expected.mean() < 0.93
    assert relative_rms(found, expected) < 0.07


def test_highlights_are_not_baked_in(painted, result):
    texels = result.texels
    points, normals = (f(result.scan.mesh, slice(None)) for f in (texels.points, texels.normals))
    shiny = np.zeros(len(texels), bool)
    for rotation, translation, light in maps_scene.shots():
        view = -rotation.T @ translation - points
        half = view / np.linalg.norm(view, axis=1, keepdims=True) + light
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        shiny |= np.einsum("ij,ij->i", half, normals) > np.cos(np.radians(6))
    shiny &= (result.maps.photos >= 2) & resolved(texels)
    assert shiny.sum() > 300
    expected, found = truth(texels)[shiny], base_color(result, 0)[shiny]
    assert relative_rms(found, expected) < 0.08
    assert abs(found.mean() / expected.mean() - 1) < 0.04


def test_texture_sizes_agree(painted, result):
    fine = run_maps_job(painted, size=2 * SIZE)
    image = fine.texels.image(base_color(fine, 0))
    seen = fine.texels.image(fine.maps.photos >= 3)
    coarse = image.reshape(SIZE, 2, SIZE, 2, 3).mean(axis=(1, 3))
    whole = seen.reshape(SIZE, 2, SIZE, 2).all(axis=(1, 3))
    own = result.texels.image(base_color(result, 0))
    assert relative_rms(own[whole], coarse[whole]) < 0.03


def test_command_writes_maps_and_scene_that_uses_them(painted):
    out = painted / "maps"
    record = json.loads((out / "maps.json").read_text())
    for file in record["files"]:
        assert (out / file["file"]).is_file()
    names = {f["file"] for f in record["files"]}
    assert {"surface_base_color.png", "surface_roughness.png", "coverage.png"} <= names
    assert 0.4 < record["seen"] <= 1 and record["materials"][0]["varies"] == "its diffuse part"
    bpy.ops.wm.open_mainfile(filepath=str(out / "scene.blend"))
    material = bpy.data.materials["surface"]
    shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    image = shader.inputs["Base Color"].links[0].from_node.image
    assert image.colorspace_settings.name == "sRGB"
    gloss = shader.inputs["Roughness"].links[0].from_node.image
    assert gloss.colorspace_settings.name == "Non-Color"
    for image in bpy.data.images:
        if image.source == "FILE" and image.users:
            assert Path(bpy.path.abspath(image.filepath)).is_file(), image.filepath
    mesh = next(o.data for o in bpy.data.objects if o.type == "MESH" and o.data.uv_layers)
    uv = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uv)
    wanted = maps_scene.surface(150, 75)[2].reshape(-1)
    assert np.abs(uv - wanted).max() < 1e-4


def test_mesh_without_texture_coordinates_is_unwrapped(painted):
    from patina.scene.scan.unwrap import unwrapped

    text = (painted / "painted.capture.toml").read_text()
    (painted / "bare").mkdir(exist_ok=True)
    maps_scene.write_scan(painted / "bare", uv=False)
    (painted / "bare" / "mesh.obj").rename(painted / "bare.obj")
    (painted / "bare.capture.toml").write_text(text.replace("mesh.obj", "bare.obj"))
    with pytest.raises(InputError, match="no texture coordinates"):
        run_maps_job(painted, "bare.capture.toml")
    found = run_maps_job(painted, "bare.capture.toml", size=512, unwrap=unwrapped)
    assert found.unwrapped and found.texels.overlapped < 0.01 * len(found.texels)
    # the painted colour at the same surface points, by the nearest texel of the mesh's own
    # coordinates
    own = capture_data.open_scan(read_capture(painted / "painted.capture.toml"))
    texels = rasterise(own.mesh, 1024)
    from scipy.spatial import cKDTree

    well = np.flatnonzero(found.maps.photos >= 3)[::7]
    tree = cKDTree(texels.points(own.mesh, slice(None)))
    _, near = tree.query(found.texels.points(found.scan.mesh, well))
    assert relative_rms(base_color(found, 0)[well], truth(texels)[near]) < 0.06


def test_result_of_another_capture_is_rejected(painted):
    text = (painted / "painted.capture.toml").read_text()
    other = painted / "other.capture.toml"
    other.write_text(text + '\n[[material]]\nname = "gold"\n')
    with pytest.raises(InputError, match=r"materials surface; expected 'gold'"):
        run_maps_job(painted, "other.capture.toml")


def test_written_images_match_estimates(result, tmp_path):
    import OpenImageIO as oiio

    files = write_maps(tmp_path, result, "exr")
    assert {f.kind for f in files} == {
        "base_color", "roughness", "albedo", "scale", "roughness_scale", "coverage", "uncertainty"
    }  # fmt: skip
    image = np.array(oiio.ImageBuf(str(tmp_path / "surface_base_color.exr")).get_pixels(oiio.FLOAT))
    there = image.reshape(-1, 3)[result.texels.place]
    assert np.abs(there - base_color(result, 0)).max() < 2e-3
    assert np.isfinite(image).all() and (image.sum(axis=2) > 0).all()  # margins and fill
    shine = np.array(oiio.ImageBuf(str(tmp_path / "surface_roughness.exr")).get_pixels(oiio.FLOAT))
    assert np.abs(shine.reshape(-1, 3)[result.texels.place, 0] - roughness(result, 0)).max() < 2e-3
