"""Mistakes in a capture file: a one-line error names the file and the key before any result is
written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from patina.core.capture import read_capture
from patina.core.errors import InputError, PatinaError
from patina.core.inputs import capture_data
from patina.core.inputs.lights import find_lights
from patina.core.inputs.photos import LitPhotos
from patina.core.jobs import FitJob
from patina.core.samples import Margins
from tests import make_capture as made


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made.make_capture(tmp_path_factory.mktemp("ball"), photos=3)


def edited(ball: Path, tmp_path: Path, change: Callable[[str], str]) -> Path:
    """A copy of the capture and its files, with the text changed."""
    import shutil

    folder = tmp_path / "copy"
    shutil.copytree(ball.parent, folder)
    text = (folder / ball.name).read_text()
    changed = change(text)
    assert changed != text
    (folder / ball.name).write_text(changed)
    return folder / ball.name


def inserted_after_light_2(line: str) -> Callable[[str], str]:
    return lambda t: t.replace('light = "lamp2"\n', f'light = "lamp2"\n{line}\n', 1)


def replaced(old: str, new: str) -> Callable[[str], str]:
    return lambda t: t.replace(old, new, 1)


def appended(tail: str) -> Callable[[str], str]:
    return lambda t: f"{t}\n{tail}\n"


TEXT_MISTAKES = {
    "unknown key": (appended("[fit]\nsample = 3"), r"\[fit\.sample\].*unknown key"),
    "unknown table": (appended("[fitt]"), r"\[fitt\].*unknown key"),
    "missing photo": (replaced("lit_2.exr", "gone.exr"), r"photo 2\.file.*no such file"),
    "missing mesh": (replaced("mesh.ply", "gone.ply"), r"scan\.mesh.*no such file"),
    "missing key": (replaced('camera = "view_02.jpg"\n', ""), r"photo 2\.camera.*missing"),
    "unknown light": (replaced('light = "lamp2"', 'light = "sun"'), r"no \[\[light\]\]"),
    "photo listed twice": (
        replaced('file = "lit_2.exr"', 'file = "lit_1.exr"'),
        r"photo 2\.file.*'lit_1\.exr' is listed more than once \(photo 1\)",
    ),
    "light of no strength": (
        replaced("irradiance = [3.0, 3.0, 3.0]", "irradiance = [1e-300, 3.0, 3.0]"),
        r"irradiance.*expected numbers from 1e-09 to 1e\+09",
    ),
    "twin names in Unicode": (
        appended(
            '[[material]]\nname = "caf\u00e9"\nfaces = "part"\n[[material]]\n'
            'name = "cafe\u0301"\nfaces = "part"'
        ),
        "is used twice",
    ),
    "label": (replaced("view_02.jpg", "view_99.jpg"), r"photo 2\.camera.*view_99"),
    "two lights of a name": (replaced('name = "lamp2"', 'name = "lamp1"'), "used twice"),
    "short vector": (
        replaced("irradiance = [3.0, 3.0, 3.0]", "irradiance = [3.0]"),
        r"light 1\.irradiance.*three numbers",
    ),
    "text for a number": (appended('[fit]\nsamples = "six"'), r"fit\.samples.*whole number"),
    "near light with an irradiance": (replaced("direction", "position"), "has no irradiance"),
    "not TOML": (appended("[[["), "not valid TOML"),
    "unknown face attribute": (
        appended('[[material]]\nname = "a"\nfaces = "x"'),
        r"material 1\.faces.*no integer face attribute",
    ),
    "mask of no material": (
        inserted_after_light_2('masks = {gold = "lit_1.exr"}'),
        r"photo 2\.masks\.gold.*no \[\[material\]\]",
    ),
}


@pytest.mark.parametrize("mistake", TEXT_MISTAKES)
def test_mistakes_in_the_text_are_reported(ball: Path, tmp_path: Path, mistake: str) -> None:
    change, message = TEXT_MISTAKES[mistake]
    path = edited(ball, tmp_path, change)
    check_rejected(path, message)


def check_rejected(path: Path, message: str) -> None:
    with pytest.raises(PatinaError, match=message) as caught:
        FitJob(read_capture(path)).drain()
    text = str(caught.value)
    assert "\n" not in text and path.name in text, text


def test_error_names_the_line(ball: Path, tmp_path: Path) -> None:
    path = edited(ball, tmp_path, lambda t: t.replace("view_02.jpg", "view_99.jpg"))
    line = path.read_text().splitlines().index('camera = "view_99.jpg"') + 1
    check_rejected(path, rf"ball\.capture\.toml:{line}: \[photo 2\.camera\]")


def unchanged_copy(ball: Path, tmp_path: Path) -> Path:
    return edited(ball, tmp_path, lambda t: t + "\n")


def test_photo_of_another_size_is_rejected(ball: Path, tmp_path: Path) -> None:
    path = unchanged_copy(ball, tmp_path)
    made.write_exr(path.parent / "lit_2.exr", np.ones((90, 121, 3)))
    check_rejected(path, r"photo 2\.file.*121 × 90.*120 × 90")


def test_nan_pixels_are_rejected(ball: Path, tmp_path: Path) -> None:
    path = unchanged_copy(ball, tmp_path)
    pixels = np.ones((90, 120, 3))
    pixels[4, 5] = np.nan
    made.write_exr(path.parent / "lit_2.exr", pixels)
    check_rejected(path, r"photo 2\.file.*1 pixels that are NaN")


def test_truncated_photo_is_rejected(ball: Path, tmp_path: Path) -> None:
    path = unchanged_copy(ball, tmp_path)
    photo = path.parent / "lit_2.exr"
    photo.write_bytes(photo.read_bytes()[:700])
    check_rejected(path, r"photo 2\.file")


def test_mesh_without_faces_is_rejected(ball: Path, tmp_path: Path) -> None:
    path = unchanged_copy(ball, tmp_path)
    made.write_ply(path.parent / "mesh.ply", np.eye(3), np.zeros((0, 3), int))
    check_rejected(path, r"mesh\.ply.*no faces")


def test_mesh_in_another_coordinate_frame_is_rejected(ball: Path, tmp_path: Path) -> None:
    path = unchanged_copy(ball, tmp_path)
    vertices, faces = made.sphere_mesh(2)
    made.write_ply(path.parent / "mesh.ply", vertices + np.array([500, 0, 0]), faces)
    check_rejected(path, r"scan\.mesh.*not in the frame")


def test_damaged_meshes_are_rejected(ball: Path, tmp_path: Path) -> None:
    path = unchanged_copy(ball, tmp_path)
    mesh = path.parent / "mesh.ply"
    original = mesh.read_bytes()
    for content in (b"", b"ply\n", original[:400], original[: len(original) // 2], b"\x00" * 64):
        mesh.write_bytes(content)
        check_rejected(path, r"mesh\.ply")
    vertices, faces = made.sphere_mesh(2)
    vertices[3] = np.nan
    made.write_ply(mesh, vertices, faces)
    check_rejected(path, r"NaN or infinite")
    faces[0, 0] = 99999
    made.write_ply(mesh, np.nan_to_num(vertices), faces)
    check_rejected(path, r"mesh\.ply")


def test_missing_cameras_are_rejected(ball: Path, tmp_path: Path) -> None:
    path = unchanged_copy(ball, tmp_path)
    cameras = path.parent / "sparse" / "images.bin"
    cameras.unlink()
    check_rejected(path, r"scan\.cameras.*no COLMAP model")


def with_gold_mask(ball: Path, tmp_path: Path, mask: np.ndarray) -> Path:
    """A capture whose first photo has a mask of a material "gold"."""
    path = edited(
        ball,
        tmp_path,
        lambda t: (
            t.replace('light = "lamp1"\n', 'light = "lamp1"\nmasks = {gold = "m.png"}\n', 1)
            + '\n[[material]]\nname = "gold"\n'
        ),
    )
    made.write_png(path.parent / "m.png", mask)
    return path


def test_mask_without_any_pixel_is_rejected(ball: Path, tmp_path: Path) -> None:
    path = with_gold_mask(ball, tmp_path, np.zeros((90, 120)))
    check_rejected(path, r"material 1\.name.*all pixels are masked")


def test_mask_of_another_size_is_rejected(ball: Path, tmp_path: Path) -> None:
    path = with_gold_mask(ball, tmp_path, np.zeros((90, 121)))
    check_rejected(path, r"photo 1\.masks\.gold.*121 × 90")


def test_light_behind_every_surface_is_rejected(ball: Path, tmp_path: Path) -> None:
    rotation, _ = next(iter(made.poses(3)))
    behind = rotation.T @ np.array([0.0, 0.0, 1.0])  # along the first camera's view
    direction = ", ".join(f"{x:.9g}" for x in behind)
    path = edited(
        ball, tmp_path,
        lambda t: t.replace(t[t.index("direction = ["): t.index("]", t.index("direction = [")) + 1],
                            f"direction = [{direction}]", 1),
    )  # fmt: skip
    check_rejected(path, r"light 1\.direction.*behind every surface")


def test_valid_capture_is_read_completely(ball: Path) -> None:
    capture = read_capture(ball)
    assert [light.name for light in capture.lights] == ["lamp1", "lamp2", "lamp3"]
    assert capture.materials[0].name == "surface"
    assert capture.fit.paper.samples == 6 and capture.fit.paper.curvature == 0.2
    with pytest.raises(InputError):
        read_capture(ball.with_name("nothing.toml"))


def test_default_method_is_measured_unless_the_file_selects_paper(tmp_path: Path) -> None:
    path = made.make_capture(tmp_path / "ball", photos=1)
    default = read_capture(path).fit
    assert default.method == "measured" and default.unused == ()
    text = path.read_text()
    path.write_text(text + '\n[fit]\nmethod = "paper"\ntrials = 3\n')
    requested = read_capture(path).fit
    assert requested.method == "paper" and requested.paper.trials == 3 and requested.unused == ()
    path.write_text(text + '\n[fit]\nmethod = "papers"\n')
    with pytest.raises(InputError, match=r"fit\.method.*'papers'.*'measured' or 'paper'"):
        read_capture(path)


def test_unused_settings_of_the_other_method_are_reported(tmp_path: Path) -> None:
    """Settings of the other method have no effect; a warning lists them."""
    path = made.make_capture(
        tmp_path / "ball", photos=1, extra="[fit]\neta = 10\nsamples = 8\nshadow_margin = 2"
    )
    capture = read_capture(path)
    assert capture.fit.unused == ("samples", "eta")
    (warning,) = capture_data.unused_settings(capture)
    assert "samples, eta" in warning and 'method = "paper"' in warning


def test_margins_of_the_caller_apply_where_the_file_sets_none(tmp_path: Path) -> None:
    path = made.make_capture(tmp_path / "ball", photos=2, extra="[fit]\nmask_margin = 4")
    margins = Margins(silhouette=7, shadow=8, mask=9, cosine=0.3)
    assert read_capture(path, margins).fit.margins == Margins(7, 8, 4, 0.3)
    assert read_capture(path).fit.margins == Margins(mask=4)


def test_mask_of_two_materials_is_refused(ball: Path, tmp_path: Path) -> None:
    text = """[[material]]
name = "steel"
[[material]]
name = "paint"
"""
    path = edited(ball, tmp_path, appended(text))
    made.write_png(path.parent / "all.png", np.full((made.HEIGHT, made.WIDTH), 255))
    both = inserted_after_light_2('masks = {steel = "all.png", paint = "all.png"}')
    path.write_text(both(path.read_text()))
    with pytest.raises(InputError, match=r"'paint' and 'steel' have the same mask 'all.png'"):
        read_capture(path)


def test_lamp_that_reaches_into_the_object_is_refused(ball: Path, tmp_path: Path) -> None:
    path = edited(ball, tmp_path, lambda text: _near_lights(text, "radius = 50.0"))
    capture = read_capture(path)
    scan = capture_data.open_scan(capture)
    with pytest.raises(InputError, match=r"radius.*the object is at a distance of"):
        find_lights(capture, scan, LitPhotos.open(capture))


def _near_lights(text: str, more: str) -> str:
    """The lights of a capture at a distance of 10 from its object."""
    lines = []
    for line in text.splitlines():
        if line.startswith("direction = "):
            x, y, z = (10 * float(n) + c for n, c in zip(
                line.split("[")[1].strip("]").split(","), made.CENTRE, strict=True
            ))  # fmt: skip
            line = f"position = [{x}, {y}, {z}]\n{more}"
        lines.append(line.replace("irradiance = [3.0", "intensity = [300.0"))
    return "\n".join(lines)


@pytest.mark.parametrize(("curve", "said"), [("srgb", True), ("linear", False), ("auto", False)])
def test_unusual_curve_is_mentioned(ball: Path, tmp_path: Path, curve: str, said: bool) -> None:
    path = edited(ball, tmp_path, appended(f'[tone]\ntransfer = "{curve}"'))
    notes = LitPhotos.open(read_capture(path)).notes
    assert any("'srgb' for EXR files, which is unusual" in note for note in notes) == said
