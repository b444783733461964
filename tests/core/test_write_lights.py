"""Lights written back into a capture file's text: only the lines concerned change."""

from __future__ import annotations

import difflib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from patina.core.capture import read_capture
from patina.core.capture.write_lights import write_lights
from patina.core.errors import PatinaError
from tests import make_capture as made

LIGHTS = '''# the capture of a Tuesday
[[light]]  # the first
  name = "lamp1"   # by the window
  direction = [ 0.0,  # x
      0.6, # y ]
      0.8 ] # up
  irradiance = [1.0, 1.0, 1.0]

[[light]]
irradiance = [1, 1, 1]
"name" = 'lamp2'
sphere = {photo = "lit_1.exr", camera = "view_01.jpg", center = [40.0, 30.5], radius = 12.0} # ball
# a note between [[light]] and
[[light]]
name = """lamp3"""
[light.sun]
latitude = 40.0
longitude = 10.0 # degrees
time = "2020-06-01T12:00:00Z"
north = [0, 1,
  0]
up = [0, 0, 1]
[light.white]
photo = "lit_1.exr"
mask = "white.png"
reflectance = 0.9

[[light]]
name = "lamp4"
mounted = [0.1, 0.2, 0.3]
intensity = [2.0, 2.0, 2.0]
beam = 30
[[light]]
name = "lamp5"
position = [500000.25, 4000000.5, 3]
intensity = [2.0, 2.0, 2.0]
[[light]]
name = "lamp6"
sphere.photo = "lit_2.exr"
sphere.camera = "view_02.jpg"
irradiance = [1.0, 1.0, 1.0]

'''


def _captured(folder: Path, lights: str = LIGHTS) -> Path:
    path = made.make_capture(folder, photos=6)
    made.write_png(folder / "white.png", np.full((made.HEIGHT, made.WIDTH), 255))
    head, tail = path.read_text().split("[[light]]", 1)
    path.write_text(head + lights + tail[tail.index("[[photo]]") :] + "\n# the end")
    return path


AXIS = np.array([0.36, 0.48, 0.8])


def test_changed_lights_are_read_back_and_rest_is_kept(tmp_path: Path) -> None:
    path = _captured(tmp_path)
    capture = read_capture(path)
    one, two, three, four, five, six = capture.lights
    lights = (
        replace(one, direction=AXIS),
        replace(two, direction=AXIS, sphere=None, angle=0.01),
        replace(three, direction=AXIS, sun=None, white=None, strength=np.array([0.1, 2.0, 3e-9])),
        replace(four, mounted=np.array([-0.1, 1 / 3, 1e-20]), radius=0.25),
        replace(five, position=five.position + 1 / 3, strength=np.array([1.0, 2.0, 1e7])),
        replace(six, direction=-AXIS, sphere=None),
    )
    write_lights(capture, lights, tmp_path / "new.capture.toml")
    back = read_capture(tmp_path / "new.capture.toml")
    for light, there in zip(lights, back.lights, strict=True):
        for key in ("direction", "position", "mounted", "strength", "angle", "radius", "beam"):
            expected, found = getattr(light, key), getattr(there, key)
            assert (expected is None) == (found is None), (light.name, key)
            assert expected is None or np.allclose(expected, found, rtol=1e-14, atol=0), (
                light.name,
                key,
            )
        assert there.sphere is there.sun is there.white is None
    old, new = path.read_text().splitlines(), (tmp_path / "new.capture.toml").read_text()
    lines = list(difflib.ndiff(old, new.splitlines()))
    gone = [line[2:] for line in lines if line.startswith("- ")]
    come = [line[2:] for line in lines if line.startswith("+ ")]
    assert sorted(line[2:] for line in come if line.startswith("# ")) == sorted(
        line for line in gone if f"# {line}" in come
    )
    assert (
        len(gone) == 3 + 1 + 7 + 4 + 1 + 2 + 2
        and "# the capture of a Tuesday" in new
        and new.endswith("# the end")
    )
    assert "  direction = [0.36, 0.48, 0.8] # up" in new
    assert "time" in new and "# longitude = 10.0 # degrees" in new
    assert sorted(p.name for p in tmp_path.iterdir() if "toml" in p.name) == [
        "ball.capture.toml",
        "new.capture.toml",
    ]


def test_unchanged_lights_give_identical_file(tmp_path: Path) -> None:
    path = _captured(tmp_path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    before, capture = path.read_bytes(), read_capture(path)
    write_lights(capture, capture.lights, tmp_path / "same.capture.toml")
    assert (tmp_path / "same.capture.toml").read_bytes() == before
    lights = (replace(capture.lights[0], direction=AXIS, radius=0.0, angle=0.02),)
    write_lights(capture, (*lights, *capture.lights[1:]), path)  # in its own place
    after = path.read_bytes()
    assert after.startswith(b"\xef\xbb\xbf") and after.count(b"\n") == after.count(b"\r\n")
    assert np.allclose(read_capture(path).lights[0].direction, AXIS)


def test_found_direction_replaces_guess(tmp_path: Path) -> None:
    path = made.make_capture(tmp_path)
    text = path.read_text("utf-8").replace("direction =", "guess = true\ndirection =", 1)
    path.write_text(text, "utf-8")
    capture = read_capture(path)
    assert capture.lights[0].guess
    found = replace(capture.lights[0], guess=False, standard_error=float(np.radians(0.5)))
    write_lights(capture, (found, *capture.lights[1:]), path)
    back = read_capture(path).lights[0]
    assert not back.guess
    assert back.standard_error == pytest.approx(np.radians(0.5))


def test_last_line_without_line_break(tmp_path: Path) -> None:
    path = _captured(tmp_path)
    head, lights = path.read_text().replace("\n# the end", "").split("[[light]]  # the first")
    lights, photos = lights.split("[[photo]]", 1)
    text = f'{head}[[photo]]{photos}\n[[light]]{lights}\n[[light]]\nposition=[1,2,3]\nname="z"'
    text = text.replace('name="z"', 'intensity=[1,1,1]\nname="z"')
    path.write_text(text)
    capture = read_capture(path)
    lights_now = (*capture.lights[:-1], replace(capture.lights[-1], radius=2.0))
    write_lights(capture, lights_now, path)
    assert path.read_text() == text + "\nradius = 2.0\n"


@pytest.mark.parametrize("other", [True, False])
def test_saving_to_another_folder_is_rejected(tmp_path: Path, other: bool) -> None:
    path = _captured(tmp_path / "a")
    if other:  # other files of the same names
        _captured(tmp_path / "b")
    else:
        (tmp_path / "b").mkdir()
    before = sorted(p.name for p in (tmp_path / "b").iterdir())
    capture = read_capture(path)
    with pytest.raises(PatinaError, match="save it in that folder"):
        write_lights(capture, capture.lights, tmp_path / "b" / "new.capture.toml")
    assert sorted(p.name for p in (tmp_path / "b").iterdir()) == before
    with pytest.raises(PatinaError, match="cannot be written"):
        write_lights(capture, capture.lights, tmp_path / "c" / "new.capture.toml")


def test_lights_in_inline_value_are_rejected(tmp_path: Path) -> None:
    names = ", ".join(
        f'{{name = "lamp{i}", direction = [0, 0, 1], irradiance = [1, 1, 1]}}' for i in range(1, 7)
    )
    path = _captured(tmp_path, "")
    path.write_text(f"light = [{names}]\n" + path.read_text())
    before, capture = path.read_bytes(), read_capture(path)
    lights = (replace(capture.lights[0], direction=AXIS), *capture.lights[1:])
    with pytest.raises(PatinaError, match=r"\[light 1\].*table of its own"):
        write_lights(capture, lights, path)
    assert path.read_bytes() == before
