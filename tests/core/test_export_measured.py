"""RGL's measured BSDF format: the container, interpolated values, and colours as spectra."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from patina.core.angles import Angles, half_difference
from patina.core.appearance.principled import Principled
from patina.core.export import measured_bsdf, spectra, tensor_file
from patina.core.export.losses import cube_root_error

SIZES = {1: "<u1", 10: "<f4"}


def read_tensor(path: Path) -> dict[str, np.ndarray]:
    """A reader of the container, written from its specification."""
    raw = path.read_bytes()
    assert raw[:12] == b"tensor_file\0" and raw[12:14] == b"\1\0"
    (count,), position, found = struct.unpack_from("<I", raw, 14), 18, {}
    for _ in range(count):
        (length,) = struct.unpack_from("<H", raw, position)
        name = raw[position + 2 : position + 2 + length].decode()
        position += 2 + length
        rank, kind, offset = struct.unpack_from("<HBQ", raw, position)
        shape = struct.unpack_from(f"<{rank}Q", raw, position + 11)
        position += 11 + 8 * rank
        size = int(np.prod(shape))
        found[name] = np.frombuffer(raw, SIZES[kind], size, offset).reshape(shape)
    return found


def grey(angles: Angles) -> np.ndarray:
    return np.full((len(np.ravel(angles.theta_h)), 3), [0.1, 0.2, 0.3])


def test_file_has_the_fields_that_renderers_check(tmp_path: Path) -> None:
    pictures = measured_bsdf.pictures(grey)
    tensor_file.write(tmp_path / "a.bsdf", pictures.fields("a description"))
    found = read_tensor(tmp_path / "a.bsdf")
    side, count = measured_bsdf.SIDE, measured_bsdf.ELEVATIONS
    wavelength_count = len(spectra.WAVELENGTHS)
    assert bytes(found["description"]).decode() == "a description"
    assert found["theta_i"].shape == (count,) and found["phi_i"].shape == (1,)
    assert found["vndf"].shape[:2] == (1, count) and found["ndf"].ndim == found["sigma"].ndim == 2
    assert found["luminance"].shape == (1, count, side, side)
    assert found["spectra"].shape == (1, count, wavelength_count, side, side)
    assert found["wavelengths"].shape == (wavelength_count,) and found["jacobian"].tolist() == [1]
    assert all(np.isfinite(a).all() and (a >= 0).all() for a in found.values() if a.dtype != "u1")
    assert (found["luminance"] > 0).all() and (np.diff(found["theta_i"]) > 0).all()
    # f cos(theta_o) = ndf/(4 sigma) * spectra; at normal incidence both cosines are 1
    assert found["ndf"][0, 0] / (4 * found["sigma"][0, 0]) * found["spectra"][0, 0, :, 0, 0] == (
        pytest.approx(spectra.BASIS @ [0.1, 0.2, 0.3], rel=1e-5)
    )


def test_matte_and_glossy_brdfs_are_reproduced() -> None:
    assert cube_root_error(measured_bsdf.pictures(grey).evaluate, grey) < 0.003
    for roughness in (0.6, 0.3, 0.15):
        model = Principled(base_color=np.array([0.4, 0.2, 0.1]), roughness=roughness)

        def reciprocal(angles: Angles, model: Principled = model) -> np.ndarray:
            swapped = Angles(angles.theta_h, angles.theta_d, np.pi - angles.phi_d)
            return 0.5 * (model.evaluate(angles) + model.evaluate(swapped))

        assert cube_root_error(measured_bsdf.pictures(reciprocal).evaluate, reciprocal) < 0.02


def test_values_at_direction_vectors() -> None:
    """A metal evaluated at light and view vectors, independently of the module's own angles."""
    model = Principled(metallic=1.0, roughness=0.4, base_color=np.array([0.9, 0.6, 0.3]))
    pictures = measured_bsdf.pictures(model.evaluate)
    rng = np.random.default_rng(5)
    directions = rng.normal(size=(2, 400, 3))
    directions[..., 2] = np.abs(directions[..., 2]) + 0.3
    light, view = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    found = pictures.evaluate(half_difference(np.array([0.0, 0.0, 1.0]), light, view))
    expected = model.reflectance(light, view)
    assert np.median(np.abs(found / expected - 1)) < 0.01


def test_colours_are_preserved_under_daylight() -> None:
    """The spectra reproduce Rec. 709 primaries under D65, lie in [0, 1] and add up to white."""
    assert (spectra.BASIS >= 0).all() and (spectra.BASIS <= 1).all()
    assert np.allclose(spectra.BASIS.sum(axis=1), 1, atol=1e-6)
    wavelengths_1nm, wavelengths_10nm = np.arange(380, 771), np.arange(380, 771, 10)
    observer = np.stack(
        [np.interp(wavelengths_1nm, wavelengths_10nm, curve) for curve in (X, Y, Z)]
    )
    light = np.interp(wavelengths_1nm, wavelengths_10nm, D65)
    reflected = [np.interp(wavelengths_1nm, spectra.WAVELENGTHS, one) for one in spectra.BASIS.T]
    for rgb, spectrum in zip(np.eye(3), reflected, strict=True):
        xyz = observer @ (light * spectrum) / (observer[1] @ light)
        assert np.allclose(TO_REC709 @ xyz, rgb, atol=3e-3)  # rounding of the tables


# CIE 1931 2° observer and daylight D65, 380 to 770 nm in steps of 10 (CIE 015)
X = [.0014, .0042, .0143, .0435, .1344, .2839, .3483, .3362, .2908, .1954, .0956, .0320, .0049,
     .0093, .0633, .1655, .2904, .4334, .5945, .7621, .9163, 1.0263, 1.0622, 1.0026, .8544, .6424,
     .4479, .2835, .1649, .0874, .0468, .0227, .0114, .0058, .0029, .0014, .0007, .0003, .0002,
     .0001]  # fmt: skip
Y = [.0000, .0001, .0004, .0012, .0040, .0116, .0230, .0380, .0600, .0910, .1390, .2080, .3230,
     .5030, .7100, .8620, .9540, .9950, .9950, .9520, .8700, .7570, .6310, .5030, .3810, .2650,
     .1750, .1070, .0610, .0320, .0170, .0082, .0041, .0021, .0010, .0005, .0002, .0001, .0001,
     .0000]  # fmt: skip
Z = [.0065, .0201, .0679, .2074, .6456, 1.3856, 1.7471, 1.7721, 1.6692, 1.2876, .8130, .4652,
     .2720, .1582, .0782, .0422, .0203, .0087, .0039, .0021, .0017, .0011, .0008, .0003, .0002,
     *[0.0] * 15]  # fmt: skip
D65 = [49.9755, 54.6482, 82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861,
       115.923, 108.811, 109.354, 107.802, 104.79, 107.689, 104.405, 104.046, 100.0, 96.3342,
       95.788, 88.6856, 90.0062, 89.5991, 87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778,
       78.2842, 69.7213, 71.6091, 74.349, 61.604, 69.8856, 75.087, 63.5927, 46.4182,
       66.8054]  # fmt: skip
TO_REC709 = [
    [3.2404542, -1.5371385, -0.4985314],
    [-0.9692660, 1.8760108, 0.0415560],
    [0.0556434, -0.2040259, 1.0572252],
]
