"""Predictions of photos: errors computed by hand, inverted encodings, and held-out photos."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import patina
from patina.core.errors import InputError
from patina.core.jobs.photo_prediction import entries_equal
from patina.core.photo.encoding import Encoding
from patina.core.photo.transfer import Transfer
from patina.core.predict.errors import PhotoErrors
from tests import make_capture as made


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> patina.Capture:
    return patina.load_capture(made.make_capture(tmp_path_factory.mktemp("ball"), photos=4))


@pytest.fixture(scope="module")
def fitted(ball: patina.Capture) -> patina.FitResult:
    return patina.fit(patina.select_photos(ball, [0, 1, 2]))


def test_errors_match_values_computed_by_hand() -> None:
    measured = np.array([[0.5, 0.0, 0.4]])
    predicted = np.array([[0.4, 0.002, 0.6]])
    errors = PhotoErrors.of(predicted, measured)
    assert errors.typical == pytest.approx(0.5)  # of 0.2, 0.002 · 255 = 0.51 and 0.5
    assert errors.encoded_rmse == pytest.approx(np.sqrt((0.01 + 0.000004 + 0.04) / 3))
    assert errors.relative_rms == pytest.approx(np.sqrt(0.050004 / 0.41))
    assert errors.pixels == 1
    none = PhotoErrors.of(np.zeros((0, 3)), np.zeros((0, 3)))
    assert none.pixels == 0 and np.isnan(none.typical)
    assert PhotoErrors.mean([errors, none]) == errors


@pytest.mark.parametrize("name", ["srgb", "bt709", "gamma:2.2", "linear"])
def test_encoding_inverts_decoding(name: str) -> None:
    transfer = Transfer.named(name)
    values = np.linspace(0, 1, 256)[:, None].repeat(3, axis=1)
    back = Encoding(transfer, bounded=True).encode(transfer.decode(values))
    assert np.abs(back - values).max() < 0.1 / 255
    beyond = Encoding(transfer, bounded=True).encode(np.full((1, 3), 2.0))
    assert (beyond == 1).all()


def test_linear_floating_point_files_are_not_clipped() -> None:
    encoded = Encoding(Transfer.named("linear"), bounded=False).encode(np.full((1, 3), 2.5))
    assert (encoded == 2.5).all()


def test_held_out_photo_is_predicted(ball: patina.Capture, fitted: patina.FitResult) -> None:
    (found,) = patina.predict(ball, fitted, photos=[3])
    assert found.name == ball.photo_name(3) and found.place == 3
    assert found.radiance.shape == found.measured.shape == (made.HEIGHT, made.WIDTH, 3)
    assert np.isfinite(found.radiance[found.compared]).all()
    assert found.errors.pixels == found.compared.sum() > 1000
    assert found.errors.typical < 0.1
    again = PhotoErrors.of(found.encoded[found.compared], found.measured[found.compared])
    assert again == found.errors


def test_prediction_does_not_use_predicted_photo(
    ball: patina.Capture, fitted: patina.FitResult
) -> None:
    """Replacing the file by another photo changes the error, not the prediction."""
    photos = (*ball.photos[:3], replace(ball.photos[3], files=ball.photos[0].files))
    (own,) = patina.predict(ball, fitted, photos=[3])
    (other,) = patina.predict(replace(ball, photos=photos), fitted, photos=[3])
    assert np.array_equal(own.radiance, other.radiance, equal_nan=True)
    assert other.errors.typical > own.errors.typical


def test_prediction_scales_with_exposure_before_encoding(
    ball: patina.Capture, fitted: patina.FitResult
) -> None:
    (one,) = patina.predict(ball, fitted, photos=[3])
    exposures = ball.photos[3].exposures or (1.0,)
    doubled = replace(ball.photos[3], exposures=tuple(2 * e for e in exposures))
    (two,) = patina.predict(replace(ball, photos=(*ball.photos[:3], doubled)), fitted, photos=[3])
    assert np.array_equal(one.radiance, two.radiance, equal_nan=True)
    assert np.allclose(two.encoded[two.compared], 2 * one.encoded[one.compared], rtol=1e-6)


def test_select_photos_keeps_lines_and_lights(ball: patina.Capture) -> None:
    some = patina.select_photos(ball, [ball.photo_name(2), 1])
    assert [photo.file for photo in some.photos] == [ball.photos[1].file, ball.photos[2].file]
    assert {light.name for light in some.lights} == {photo.light for photo in some.photos}
    for place, old in enumerate((1, 2)):
        assert some.lines["photo", place, "file"] == ball.lines["photo", old, "file"]


@pytest.mark.parametrize(
    ("photos", "message"), [(["no.exr"], "no photo"), ([9], "9"), ([], "no photo is selected")]
)
def test_invalid_photo_selection_is_named(ball: patina.Capture, photos: list, message: str) -> None:
    with pytest.raises(InputError, match=message):
        patina.select_photos(ball, photos)


def test_light_of_unknown_intensity_is_rejected(
    ball: patina.Capture, fitted: patina.FitResult
) -> None:
    lights = tuple(replace(light, name=f"{light.name}x", strength=None) for light in ball.lights)
    photos = tuple(replace(photo, light=f"{photo.light}x") for photo in ball.photos)
    with pytest.raises(InputError, match="strength relative to the fitted lights is unknown"):
        patina.predict(replace(ball, lights=lights, photos=photos), fitted, photos=[0])


def test_entries_with_arrays_compare_equal(ball: patina.Capture) -> None:
    light = ball.lights[0]
    assert entries_equal(light, replace(light, direction=np.array(light.direction)))
    assert not entries_equal(light, replace(light, direction=-np.array(light.direction)))


def test_export_writes_what_the_command_line_reads(
    fitted: patina.FitResult, tmp_path: Path
) -> None:
    from patina.core.result import read_result

    patina.export(fitted, tmp_path, ["json", "npz"])
    read = read_result(tmp_path)
    ours = fitted.materials[0].fit.brdf.coefficients
    assert np.array_equal(read.materials[0].brdf.coefficients, ours)
    with pytest.raises(InputError, match="expected one of"):
        patina.export(fitted, tmp_path, ["nonsense"])


def test_package_exports_names_of_api() -> None:
    from patina import api

    assert sorted(patina.__all__) == sorted(api.__all__)
    for name in patina.__all__:
        assert getattr(patina, name) is getattr(api, name)
    with pytest.raises(AttributeError):
        _ = patina.nonsense
