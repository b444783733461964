"""`predict CAPTURE RESULT --out DIR`: pictures and errors of photos, from a result folder."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import patina
from patina.commands import command_line
from patina.core.concurrency.steps import drained
from patina.core.errors import InputError
from patina.core.jobs.fitted_scene import FittedScene, scene_of_result
from patina.core.photo import read_photo
from patina.core.predict.flip import flip_available, flip_error
from patina.core.result import read_result
from tests import make_capture as made


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A capture of four photos, one of its first three, and the result of a fit of these."""
    folder = tmp_path_factory.mktemp("ball")
    whole = made.make_capture(folder, photos=4)
    text = whole.read_text("utf-8")
    assert text.count("[[photo]]") == 4
    some = whole.with_name("some.capture.toml")
    some.write_text("[[photo]]".join(text.split("[[photo]]")[:4]), "utf-8")
    fitted = patina.fit(patina.load_capture(some))
    patina.export(fitted, folder / "result", ["json"])
    return folder


def predicted(folder: Path, capture: str, out: str) -> dict:
    code = command_line.main(
        ["predict", str(folder / capture), str(folder / "result"), "--out", str(folder / out)]
    )
    assert code == 0
    return json.loads((folder / out / "errors.json").read_text("utf-8"))


def test_held_out_photos_are_told_from_fitted_ones(folder: Path, capsys) -> None:
    capture = next(folder.glob("*.capture.toml")).parent
    whole = next(f.name for f in capture.glob("*.capture.toml") if f.name != "some.capture.toml")
    found = predicted(folder, whole, "out")
    assert [photo["fitted"] for photo in found["photos"]] == [True, True, True, False]
    assert found["overall"]["photos"] == 4 and found["held_out"]["photos"] == 1
    assert found["held_out"]["typical"] == found["photos"][3]["typical"] < 0.1
    mean = np.mean([photo["encoded_rmse"] for photo in found["photos"]])
    assert found["overall"]["encoded_rmse"] == pytest.approx(mean)
    assert "mean of 1 held-out photo:" in capsys.readouterr().out
    for place in range(1, 5):
        for kind in ("photo", "prediction", "difference"):
            picture = read_photo(folder / "out" / f"photo_{place:02d}_{kind}.png")
            assert picture.radiance.shape == (made.HEIGHT, made.WIDTH, 3)


def test_the_command_predicts_what_the_library_does(folder: Path) -> None:
    capture = patina.load_capture(folder / "some.capture.toml")
    expected = patina.predict(capture, patina.fit(capture))
    found = predicted(folder, "some.capture.toml", "same")
    assert found["held_out"] is None
    for photo, one in zip(found["photos"], expected, strict=True):
        assert photo["typical"] == pytest.approx(one.errors.typical, rel=1e-3)
        assert photo["pixels"] == one.errors.pixels


def test_the_scene_of_a_result_is_that_of_the_fit(folder: Path) -> None:
    capture = patina.load_capture(folder / "some.capture.toml")
    again = drained(scene_of_result(capture, read_result(folder / "result")))
    fitted = FittedScene.of(patina.fit(capture).details)
    assert np.array_equal(again.face_material, fitted.face_material)
    assert again.materials[0].scale == pytest.approx(fitted.materials[0].scale)
    other = replace(capture, materials=(replace(capture.materials[0], name="other"),))
    with pytest.raises(InputError, match="expected 'other'"):
        drained(scene_of_result(other, read_result(folder / "result")))


@pytest.mark.skipif(not flip_available(), reason="flip-evaluator is not installed")
def test_flip_ignores_pixels_that_are_not_compared() -> None:
    rng = np.random.default_rng(0)
    photo = rng.integers(0, 255, (40, 60, 3)).astype(np.uint8)
    other = np.where(np.arange(60)[:, None] < 30, photo, 255 - photo)
    left = np.broadcast_to(np.arange(60) < 30, (40, 60))
    assert flip_error(other, photo, left) == pytest.approx(0, abs=1e-6)
    assert flip_error(other, photo, ~left) > 0.1
    assert np.isnan(flip_error(other, photo, np.zeros((40, 60), bool)))
