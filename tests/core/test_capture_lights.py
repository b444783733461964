"""Lights, tone, exposure brackets and painted materials in a capture file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from patina.core.capture import read_capture
from patina.core.errors import InputError, PatinaError
from patina.core.inputs import capture_data
from patina.core.inputs.lights import find_lights
from patina.core.inputs.photos import LitPhotos
from patina.core.jobs import FitJob
from patina.core.light import DistantLight
from patina.core.photo.photo import read_photo
from tests import make_capture as made
from tests import make_photos
from tests.sampled import sampled


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    return made.make_capture(tmp_path)


def with_light(path: Path, *lines: str) -> Path:
    """Rewrite the capture so that all photos use one light, described by these lines."""
    text = path.read_text()
    scan, photos = text.partition("[[light]]")[0], text[text.index("[[photo]]") :]
    for i in range(1, 7):
        photos = photos.replace(f'light = "lamp{i}"', 'light = "lamp"')
    light = "\n".join(["[[light]]", 'name = "lamp"', *lines, ""])
    path.write_text(scan + light + photos)
    return path


LIGHT_MISTAKES = {
    "two ways": (["direction = [0, 0, 1]", "position = [0, 0, 1]"], "found direction and position"),
    "no way": (["irradiance = [1, 1, 1]"], "found none of them"),
    "near with irradiance": (["position = [0, 0, 1]", "irradiance = [1, 1, 1]"], "expected intens"),
    "distant with intensity": (["direction = [0, 0, 1]", "intensity = [1, 1, 1]"], "expected irra"),
    "beam of a lamp": (["position = [0, 0, 1]", "beam = 30"], "unknown key 'beam'"),
    "radius of a sun": (["direction = [0, 0, 1]", "radius = 2"], "unknown key 'radius'"),
    "no zone": (['sun = {time = "2018-06-01T12:00:00"}'], "has no time zone"),
    "no such day": (['sun = {time = "2018-06-31T12:00:00+09:00"}'], "is not a date"),
    "half a place": (["sun = {latitude = 3.0}"], "only one of latitude and longitude"),
    "up without north": (["sun = {up = [0, 0, 1]}"], "only one of north and up"),
    "sphere without camera": (['sphere = {photo = "lit_1.exr"}'], "'camera' is missing"),
    "half an outline": (
        ['sphere = {photo = "lit_1.exr", camera = "view_01", radius = 4}'], "center and radius",
    ),
    "sphere elsewhere": (
        ['sphere = {photo = "gone.exr", camera = "view_01"}'], "no such file.*gone.exr",
    ),
    "kind of sphere": (
        ['sphere = {photo = "lit_1.exr", camera = "view_01", surface = "matte"}'], "'glossy'",
    ),
    "white twice": (
        ["direction = [0, 0, 1]", "irradiance = [1, 1, 1]",
         'white = {photo = "lit_1.exr", mask = "lit_1.exr", reflectance = 0.9}'],
        "given more than once",
    ),
    "white of a flash": (
        ["mounted = [0, 0, 0]",
         'white = {photo = "lit_1.exr", mask = "lit_1.exr", reflectance = 0.9}'], "distant light",
    ),
    "a sphere beyond all": (
        ['sphere = {photo = "lit_1.exr", camera = "view_01", center = [6, 4], radius = 1e300}'],
        "expected a number from 1 to 131072",
    ),
    "a number Python will not write": (
        [f"direction = [0x{'f' * 5000}, 0, 0]"], "a number too large|three numbers",
    ),
    "a text that is none": (["direction = [0, 0, 1]", f"refine = 0x{'f' * 5000}"], "too large"),
    "a guess with an error": (
        ["direction = [0, 0, 1]", "guess = true", "standard_error = 1"], "no standard error",
    ),
    "a guessed sphere": (
        ['sphere = {photo = "lit_1.exr", camera = "view_01"}', "guess = true"],
        "the sphere gives the direction",
    ),
    "refine": (["direction = [0, 0, 1]", "refine = 1"], "true or false"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", LIGHT_MISTAKES)
def test_error_names_the_light_and_the_file(ball: Path, mistake: str) -> None:
    lines, message = LIGHT_MISTAKES[mistake]
    path = with_light(ball, *lines)
    with pytest.raises(InputError, match=message) as caught:
        read_capture(path)
    assert f"{path}:" in str(caught.value) and "light 1" in str(caught.value)
    assert "\n" not in str(caught.value)


def lights_of(path: Path):
    capture = read_capture(path)
    scan = capture_data.open_scan(capture)
    return find_lights(capture, scan, LitPhotos.open(capture))


def test_sun_direction_from_place_and_time(ball: Path) -> None:
    """Noon at the equator on the March equinox: the sun is overhead within 1°."""
    lines = 'time = "2021-03-20T12:07:30Z", north = [0, 2, 0], up = [0, 0, 3]'
    found = lights_of(with_light(ball, f"sun = {{latitude = 0.0, longitude = 0.0, {lines}}}"))
    light = found.by_name["lamp"]
    assert isinstance(light, DistantLight)
    assert np.degrees(np.arccos(light.direction[2])) < 1.0
    assert np.degrees(light.angular_radius) == pytest.approx(0.266, abs=0.01)
    assert "elevation" in " ".join(found.notes)


def test_sun_without_north_is_rejected(ball: Path) -> None:
    path = with_light(ball, 'sun = {latitude = 50, longitude = 8, time = "2021-06-01T12:00:00Z"}')
    with pytest.raises(InputError, match=r"light 1\.sun.*north"):
        lights_of(path)


def test_sun_below_the_horizon_is_rejected(ball: Path) -> None:
    time = 'time = "2021-06-01T00:00:00Z", north = [0, 1, 0], up = [0, 0, 1]'
    path = with_light(ball, f"sun = {{latitude = 50.0, longitude = 8.0, {time}}}")
    with pytest.raises(InputError, match="below the horizon"):
        lights_of(path)


def test_sun_direction_from_photo_exif(ball: Path, shared: Path) -> None:
    """The EXIF time of the drone photo has no time zone: the error asks for one, and a time in the
    capture file replaces it."""
    photo = shared / "data" / "real" / "brighton_sun.jpg"
    path = with_light(ball, "sun = {north = [0, 1, 0], up = [0, 0, 1]}")
    text = path.read_text().replace('"lit_1.exr"', f'"{photo}"')
    path.write_text(text.replace("camera = ", "exposure = 1.0\ncamera = "))
    with pytest.raises(InputError, match=r"sun.*(zone|time)"):
        lights_of(path)
    time = 'time = "2016-06-23T16:33:00-05:00"'
    path.write_text(path.read_text().replace("sun = {", f"sun = {{{time}, "))
    light = lights_of(path).by_name["lamp"]
    east, north, up = light.direction
    assert np.degrees(np.arcsin(up)) == pytest.approx(43.5, abs=0.3)
    assert np.degrees(np.arctan2(east, north)) % 360 == pytest.approx(257.9, abs=0.5)


def test_white_target_gives_the_irradiance(ball: Path) -> None:
    folder = ball.parent
    white = np.full((60, 80, 3), 0.05)
    white[20:40, 30:60] = np.array([0.9, 0.8, 0.7]) / np.pi * 0.5 * 4
    mask = np.zeros((60, 80))
    mask[22:38, 32:58] = 255
    made.write_exr(folder / "white.exr", white)
    made.write_png(folder / "white.png", mask)
    target = 'photo = "white.exr", mask = "white.png", reflectance = 0.5'
    path = with_light(ball, "direction = [0, 0, 1]", f"white = {{{target}}}")
    light = lights_of(path).by_name["lamp"]
    assert light.irradiance == pytest.approx(np.array([3.6, 3.2, 2.8]), rel=1e-3)
    tilted = f"white = {{{target}, normal = [0, 0.6, 0.8]}}"
    path.write_text(path.read_text().replace(f"white = {{{target}}}", tilted))
    light = lights_of(path).by_name["lamp"]
    assert light.irradiance == pytest.approx(np.array([3.6, 3.2, 2.8]) / 0.8, rel=1e-3)


def test_chart_gives_the_irradiance(ball: Path) -> None:
    """Patches of reflectance R under irradiance E have radiance R E n·l / π; both are recovered."""
    greys, irradiance_over_pi = [0.05, 0.1, 0.2, 0.4, 0.8], 2.0
    grey_scale = np.full((40, 200, 3), 0.01)
    for i, grey in enumerate(greys):
        grey_scale[:, 40 * i : 40 * i + 40] = grey * irradiance_over_pi * 0.8 / np.pi
    made.write_exr(ball.parent / "scale.exr", grey_scale)
    chart = f'photo = "scale.exr", corners = [[20, 20], [180, 20]], reflectance = {greys}'
    path = with_light(ball, "direction = [0, 0.6, 0.8]")
    text = path.read_text()
    path.write_text(f'[tone]\nchart = {{{chart}, light = "lamp", normal = [0, 0, 1]}}\n' + text)
    capture = read_capture(path)
    photos = LitPhotos.open(capture)
    light = find_lights(capture, capture_data.open_scan(capture), photos).by_name["lamp"]
    assert light.irradiance == pytest.approx(np.full(3, np.pi / 0.8))
    # a Lambertian of reflectance 0.3 under the lamp: decoded, ρ = L / (E n·l) is 0.3 / π
    encoded = np.full((1, 1, 3), 0.3 * irradiance_over_pi * 0.8 / np.pi)
    radiance = photos.curve(0).decode(encoded)
    assert radiance / (light.irradiance * 0.8) == pytest.approx(0.3 / np.pi, rel=0.02)
    path.write_text(path.read_text().replace('light = "lamp", normal', 'light = "sun", normal'))
    with pytest.raises(InputError, match=r"tone\.chart.*no \[\[light\]\] is named 'sun'"):
        read_capture(path)


def test_white_target_uses_the_transfer_of_the_photos(ball: Path) -> None:
    """A 16-bit PNG states no transfer function: the one set for the photos is used."""
    folder = ball.parent
    make_photos.write_png(folder / "white.png", np.full((60, 80, 3), 32768, np.uint16))
    made.write_png(folder / "mask.png", np.full((60, 80), 255))
    target = 'white = {photo = "white.png", mask = "mask.png", reflectance = 0.9}'
    path = with_light(ball, "direction = [0, 0, 1]", target)
    path.write_text(path.read_text().replace("camera = ", 'transfer = "linear"\ncamera = '))
    found = lights_of(path)
    light = found.by_name["lamp"]
    assert light.irradiance == pytest.approx(np.full(3, np.pi * 0.5 / 0.9), rel=1e-3)
    assert not any("sRGB" in note for note in found.notes)
    photo = read_photo(folder / "white.png", "linear")
    assert not any("assumed" in note or "read as sRGB" in note for note in photo.info.notes)
    assert any("read as sRGB" in note for note in read_photo(folder / "white.png").info.notes)


def test_irradiance_given_for_only_some_lights_is_rejected(ball: Path) -> None:
    path = ball
    text = path.read_text().replace("irradiance = [3.0, 3.0, 3.0]\n", "", 1)
    path.write_text(text)
    with pytest.raises(InputError, match=r"light 1\.irradiance.*for all lights or for none"):
        read_capture(path)


def test_exposure_known_for_only_some_photos_is_rejected(ball: Path) -> None:
    path, folder = ball, ball.parent
    pixels = np.full((90, 120, 3), 128, np.uint8)
    write_jpeg(folder / "one.jpg", pixels, exposure=1 / 60)
    path.write_text(path.read_text().replace('"lit_2.exr"', '"one.jpg"'))
    with pytest.raises(
        InputError, match=r"photo 1\.exposure.*lit_1.exr has no exposure in its EXIF"
    ):
        LitPhotos.open(read_capture(path))


def test_exif_exposures_are_relative_to_the_first_photo(ball: Path) -> None:
    path, folder = ball, ball.parent
    for i in range(1, 7):
        exposure = 1 / 50 if i == 1 else 1 / 200
        # sRGB levels 200 and 108 decode to 0.5776 and 0.1500, about a quarter
        level = 200 if i == 1 else 108
        write_jpeg(folder / f"{i}.jpg", np.full((90, 120, 3), level, np.uint8), exposure)
        path.write_text(path.read_text().replace(f'"lit_{i}.exr"', f'"{i}.jpg"'))
    photos = LitPhotos.open(read_capture(path))
    assert photos.exposures[0] == (1.0,) and photos.exposures[1] == pytest.approx((0.25,), rel=1e-3)
    first, second = photos.read(0).radiance, photos.read(1).radiance
    assert second.mean() / first.mean() == pytest.approx(0.1500 / 0.5776 * 4, rel=0.02)


def test_stated_and_exif_exposures_are_not_mixed(ball: Path) -> None:
    pixels = np.full((90, 120, 3), 128, np.uint8)
    text = ball.read_text()
    for i in range(1, 7):
        write_jpeg(ball.parent / f"{i}.jpg", pixels, exposure=1 / 60)
        text = text.replace(f'"lit_{i}.exr"', f'"{i}.jpg"')
    ball.write_text(text.replace('file = "1.jpg"', 'file = "1.jpg"\nexposure = 1.0'))
    with pytest.raises(InputError, match=r"photo 1\.exposure.*another unit"):
        LitPhotos.open(read_capture(ball))


def test_exposure_times_that_differ_are_rejected_for_a_flash(ball: Path) -> None:
    path = with_light(ball, "mounted = [0, 0, 0]")
    text = path.read_text()
    for i in range(1, 7):
        exposure = 1 / 60 if i == 1 else 1 / 125
        pixels = np.full((90, 120, 3), 128, np.uint8)
        write_jpeg(ball.parent / f"{i}.jpg", pixels, exposure)
        text = text.replace(f'"lit_{i}.exr"', f'"{i}.jpg"')
    path.write_text(text)
    with pytest.raises(InputError, match="a flash's light does not depend"):
        LitPhotos.open(read_capture(path))


def test_vertex_colour_without_any_face_is_rejected(ball: Path) -> None:
    vertices, faces = made.sphere_mesh(2)
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"property uchar {c}" for c in ("red", "green", "blue")]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(f"{x:.9g}" for x in position) + " 10 10 250" for position in vertices]
    lines += ["3 " + " ".join(map(str, face)) for face in faces]
    (ball.parent / "mesh.ply").write_text("\n".join(lines) + "\n")
    ball.write_text(ball.read_text() + '[[material]]\nname = "a"\nvertex_colour = [255, 0, 0]\n')
    with pytest.raises(InputError, match=r"material 1\.vertex_colour.*no face"):
        capture_data.open_scan(read_capture(ball))


def test_near_and_distant_lights_without_intensity_are_rejected(ball: Path) -> None:
    text = ball.read_text().replace("irradiance = [3.0, 3.0, 3.0]\n", "")
    first = text.index("direction")
    end = text.index("\n", first)
    ball.write_text(text[:first] + "position = [3, 3, 3]" + text[end:])
    with pytest.raises(InputError, match=r"light 1\.intensity.*no common scale"):
        read_capture(ball)


def test_clipped_pixels_are_excluded_from_the_samples(ball: Path) -> None:
    all_samples, _ = sampled(ball)
    text = ball.read_text()
    ball.write_text(text.replace('file = "lit_1.exr"', 'file = "lit_1.exr"\nsaturation = 0.2'))
    job = FitJob(read_capture(ball), portable=False)
    job.drain()
    assert job.result is not None
    clipped = (all_samples.radiance[all_samples.photo == 0] >= 0.2 * 0.99).any(axis=1)
    per_photo = job.result.materials[0].per_photo
    assert clipped.sum() > 100
    assert per_photo[0] == pytest.approx((all_samples.photo == 0).sum() - clipped.sum(), abs=20)


def test_materials_from_vertex_colours(ball: Path) -> None:
    """Two vertex colours split the mesh into two materials."""
    vertices, faces = made.sphere_mesh()
    is_upper = vertices[:, 2] > made.CENTRE[2]
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"property uchar {c}" for c in ("red", "green", "blue")]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    for position, up in zip(vertices, is_upper, strict=True):
        colour = "250 10 10" if up else "10 10 250"
        lines.append(" ".join(f"{x:.9g}" for x in position) + f" {colour}")
    lines += ["3 " + " ".join(map(str, face)) for face in faces]
    (ball.parent / "mesh.ply").write_text("\n".join(lines) + "\n")
    extra = '[[material]]\nname = "red"\nvertex_colour = [255, 0, 0]\n'
    extra += '[[material]]\nname = "blue"\nvertex_colour = [0, 0, 255]\n'
    ball.write_text(ball.read_text() + extra)
    job = FitJob(read_capture(ball), portable=False)
    job.drain()
    assert job.result is not None
    centre = vertices[faces].mean(axis=1)[:, 2]
    off_boundary = np.abs(centre - made.CENTRE[2]) > 0.1
    assert ((centre > made.CENTRE[2]) == (job.result.face_material == 0))[off_boundary].all()
    assert min(m.samples for m in job.result.materials) > 1000


def test_cameras_of_an_extra_file_are_available(ball: Path) -> None:
    """A camera from an extra cameras file can be used like a camera of the scan."""
    capture = read_capture(ball)
    camera = capture_data.open_scan(capture).cameras[0]
    entry = {
        "label": "later", "width": camera.width, "height": camera.height, "model": camera.model,
        "parameters": list(camera.parameters), "rotation": camera.pose.rotation.tolist(),
        "translation": camera.pose.translation.tolist(), "photo": None,
    }  # fmt: skip
    extra = {"patina_cameras": 1, "frame": "mesh", "cameras": [entry]}
    (ball.parent / "later.cameras.json").write_text(json.dumps(extra))
    text = ball.read_text().replace('camera = "view_01.jpg"', 'camera = "later"')
    ball.write_text(text.replace("[scan]", '[scan]\nextra = "later.cameras.json"'))
    extended = read_capture(ball)
    scan = capture_data.open_scan(extended)
    pose = capture_data.camera_of(extended, scan, 0).pose
    assert np.allclose(pose.translation, camera.pose.translation)
    entry["label"] = "view_02.jpg"
    (ball.parent / "later.cameras.json").write_text(json.dumps(extra))
    with pytest.raises(PatinaError, match=r"scan\.extra.*already"):
        capture_data.open_scan(extended)


def write_jpeg(path: Path, pixels: np.ndarray, exposure: float) -> None:
    import OpenImageIO as oiio

    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")
    spec.attribute("ExposureTime", float(exposure))
    spec.attribute("FNumber", 8.0)
    spec.attribute("Exif:PhotographicSensitivity", 100)
    spec.attribute("CompressionQuality", 98)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec)
    out.write_image(pixels)
    out.close()
