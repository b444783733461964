"""Exposure, time and place from the file; damaged or ambiguous values are absent, not guessed."""

from __future__ import annotations

import io
import struct
from datetime import UTC, datetime, timedelta
from fractions import Fraction
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError
from patina.core.photo import Exif, read_exif
from patina.core.photo.tiff_tags import read_tiff_tags
from tests import make_photos as made

MAIN = {271: made.ascii_tag("Maker"), 272: made.ascii_tag("Model 1\0rubbish"), 274: (3, [6])}
EXIF = {
    0x829A: made.rationals((1, 125)),
    0x829D: made.rationals((13, 1)),
    0x8827: (3, [200]),
    0x920A: made.rationals((24, 1)),
    0xA405: (3, [36]),
    0x9209: (3, [0x19]),
    0xA434: made.ascii_tag("A lens  24mm "),
    0x9003: made.ascii_tag("2018:06:01 12:30:15"),
    0x9011: made.ascii_tag("+09:00"),
    0x9291: made.ascii_tag("25"),
    0x927C: (7, b"MakerNote" * 40),
}
GPS = {
    1: made.ascii_tag("S"),
    2: made.rationals((33, 1), (51, 1), (2520, 100)),
    3: made.ascii_tag("E"),
    4: made.rationals((151, 1), (12, 1), (0, 1)),
    5: (1, [1]),
    6: made.rationals((35, 2)),
    7: made.rationals((3, 1), (30, 1), (1550, 100)),
    0x1D: made.ascii_tag("2018:06:01"),
}
PIXELS = np.full((8, 8, 3), 90, np.uint8)


def cr3(main: bytes, exif: bytes, gps: bytes) -> bytes:
    def box(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I4s", len(body) + 8, kind) + body

    inner = bytes.fromhex("85c0b687820f11e08111f4ce462b6a48") + b"".join(
        box(kind, body) for kind, body in ((b"CMT1", main), (b"CMT2", exif), (b"CMT4", gps))
    )
    return box(b"ftyp", b"crx \0\0\0\1") + box(b"moov", box(b"uuid", inner))


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("exif")
    block = made.tiff_bytes(MAIN, EXIF, GPS)
    for order, name in (("<", "little"), (">", "big")):
        whole = made.tiff_bytes(MAIN, EXIF, GPS, order=order)
        made.write_jpeg(folder / f"{name}.jpg", PIXELS, (made.app1_exif(whole),))
        made.write_png(folder / f"{name}.png", PIXELS, [(b"eXIf", whole)])
        made.write_tiff(folder / f"{name}.tif", PIXELS, MAIN, order=order, exif=EXIF, gps=GPS)
    # camera RAW: structures of the TIFF family, or boxes and JPEGs that contain one
    (folder / "p.nef").write_bytes(block)
    (folder / "p.orf").write_bytes(b"IIRO" + block[4:])
    (folder / "p.rw2").write_bytes(b"IIU\0" + block[4:])
    jpeg = (folder / "little.jpg").read_bytes()
    fuji = b"FUJIFILMCCD-RAW " + bytes(68) + struct.pack(">II", 200, len(jpeg))
    (folder / "p.raf").write_bytes(fuji.ljust(200, b"\0") + jpeg)
    parts = [made.tiff_bytes(part) for part in (MAIN, EXIF, GPS)]
    (folder / "p.cr3").write_bytes(cr3(*parts))
    return sorted(folder.iterdir())


def test_all_file_formats_give_same_metadata(files: list[Path]) -> None:
    assert len(files) == 11
    for path in files:
        found = read_exif(path)
        assert found.exposure_time == pytest.approx(1 / 125)
        assert (found.f_number, found.iso) == (13, 200)
        assert (found.focal_length, found.focal_length_35mm) == (24, 36)
        assert found.datetime_original == datetime(2018, 6, 1, 12, 30, 15, 250000), path.name
        assert found.offset_original == timedelta(hours=9)
        assert found.utc == datetime(2018, 6, 1, 3, 30, 15, 250000, UTC)
        assert found.gps_utc == datetime(2018, 6, 1, 3, 30, 15, 500000, UTC)
        assert found.latitude == pytest.approx(-(33 + 51 / 60 + 25.2 / 3600), abs=1e-9)
        assert found.longitude == pytest.approx(151.2, abs=1e-9)
        assert found.altitude == -17.5
        assert (found.make, found.model, found.lens) == ("Maker", "Model 1", "A lens 24mm")
        assert found.orientation == 6 and found.flash_fired is True
        assert found.relative_exposure == pytest.approx(1 / 125 * 200 / 100 / 13**2)
        assert found.missing == ()


def exif_of(tmp_path: Path, main=None, exif=None, gps=None) -> Exif:
    path = tmp_path / "p.tif"
    made.write_tiff(path, PIXELS, main, exif=exif or {}, gps=gps or {})
    return read_exif(path)


@pytest.mark.parametrize(
    ("value", "fired"),
    [((3, [0x10]), False), ((3, [0x5F]), True), (None, None), ((3, [300]), None)],
)
def test_flash_is_known_only_if_stated(tmp_path: Path, value, fired) -> None:
    assert exif_of(tmp_path, exif={} if value is None else {0x9209: value}).flash_fired is fired


def test_relative_exposure_is_proportional_to_light(tmp_path: Path) -> None:
    def relative(time, aperture, iso) -> float:
        exif = {0x829A: made.rationals(time), 0x829D: made.rationals(aperture), 0x8827: (3, [iso])}
        return exif_of(tmp_path, exif=exif).relative_exposure

    base = relative((1, 100), (4, 1), 100)
    assert base == pytest.approx(0.01 / 16)
    assert relative((1, 50), (4, 1), 100) == pytest.approx(2 * base)
    assert relative((1, 100), (8, 1), 100) == pytest.approx(base / 4)
    assert relative((1, 100), (4, 1), 400) == pytest.approx(4 * base)


@pytest.mark.parametrize("tag", [0x829A, 0x829D])
@pytest.mark.parametrize("value", [(0, 0), (1, 0), (0, 1)])
def test_zero_denominators_count_as_missing(tmp_path: Path, tag: int, value) -> None:
    found = exif_of(tmp_path, exif={**EXIF, tag: made.rationals(value)})
    assert found.relative_exposure is None
    assert found.missing == ({0x829A: "exposure time", 0x829D: "f-number"}[tag],)


def test_apex_values_are_used_as_fallback(tmp_path: Path) -> None:
    exif = {
        0x9201: made.rationals((7, 1), signed=True),
        0x9202: made.rationals((6, 1)),
        0x8827: (3, [65535]),
        0x8831: (4, [102400]),
    }
    found = exif_of(tmp_path, exif=exif)
    assert (found.exposure_time, found.f_number, found.iso) == (1 / 128, 8, 102400)


def test_edit_time_is_not_photo_time(tmp_path: Path) -> None:
    main = {306: made.ascii_tag("2020:01:01 00:00:00")}
    exif = {
        0x9004: made.ascii_tag("2019:01:01 00:00:00"),  # time of digitisation
        0x9010: made.ascii_tag("-05:00"),  # time zone of the edit
    }
    found = exif_of(tmp_path, main, exif)
    assert found.datetime_original is None and found.offset_original is None
    assert found.utc is None


@pytest.mark.parametrize(
    "text", ["0000:00:00 00:00:00", "    :  :     :  :  ", "2018:02:30 10:00:00", "", "x" * 19]
)
def test_invalid_times_are_ignored(tmp_path: Path, text: str) -> None:
    assert exif_of(tmp_path, exif={0x9003: made.ascii_tag(text)}).datetime_original is None


@pytest.mark.parametrize(
    ("text", "hours"),
    [
        ("+05:30", 5.5), ("-03:30", -3.5), ("Z", 0), ("   :  ", None), ("+9:00", None),
        ("+25:00", None), ("+05:61", None),
    ],
)  # fmt: skip
def test_time_zone_offsets(tmp_path: Path, text: str, hours) -> None:
    found = exif_of(tmp_path, exif={0x9011: made.ascii_tag(text)}).offset_original
    assert found == (None if hours is None else timedelta(hours=hours))


@pytest.mark.parametrize(
    "change",
    [
        {1: made.ascii_tag("X")},
        {1: made.ascii_tag("")},
        {2: made.rationals((91, 1), (0, 1), (0, 1))},
        {2: made.rationals((0, 0), (0, 0), (0, 0))},
        {7: made.rationals((25, 1), (0, 1), (0, 1))},
        {7: made.rationals((1, 0), (0, 1), (0, 1))},
        {0x1D: made.ascii_tag("")},
    ],
)
def test_invalid_places_are_ignored(tmp_path: Path, change: dict) -> None:
    found = exif_of(tmp_path, gps=GPS | change)
    wrong = found.gps_utc if max(change) >= 7 else found.latitude
    assert wrong is None and found.longitude == pytest.approx(151.2)


def test_place_in_decimal_degrees(tmp_path: Path) -> None:
    found = exif_of(tmp_path, gps=GPS | {2: made.rationals((338570000, 10000000), (0, 0), (0, 0))})
    assert found.latitude == pytest.approx(-33.857, abs=1e-9)


def test_files_without_metadata(tmp_path: Path) -> None:
    made.write_png(tmp_path / "p.png", PIXELS)
    made.write_jpeg(tmp_path / "p.jpg", PIXELS)
    for name in ("p.png", "p.jpg"):
        assert read_exif(tmp_path / name) == Exif()
        assert read_exif(tmp_path / name).missing == ("exposure time", "f-number", "ISO")
    with pytest.raises(InputError, match="no such file"):
        read_exif(tmp_path / "x.jpg")


def test_exr_attributes(tmp_path: Path) -> None:
    path = tmp_path / "p.exr"
    spec = oiio.ImageSpec(4, 4, 3, "half")
    for name, value in {
        "ExposureTime": 0.02, "FNumber": 5.6, "isoSpeed": 400.0, "latitude": -33.5,
        "longitude": 151.25, "altitude": 12.0, "cameraModel": "Model 1",
    }.items():  # fmt: skip
        spec.attribute(name, value)
    spec.attribute("DateTime", "2020:01:01 00:00:00")  # when it was written
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), spec)
    out.write_image(np.ones((4, 4, 3), np.float32))
    out.close()
    found = read_exif(path)
    assert found.relative_exposure == pytest.approx(0.02 * 4 / 5.6**2, rel=1e-6)
    assert (found.latitude, found.longitude, found.altitude) == (-33.5, 151.25, 12)
    assert found.model == "Model 1" and found.datetime_original is None


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_damaged_structures(data: st.DataObject) -> None:
    whole = bytearray(made.tiff_bytes(MAIN, EXIF, GPS, order=data.draw(st.sampled_from("<>"))))
    for _ in range(data.draw(st.integers(1, 8))):
        whole[data.draw(st.integers(4, len(whole) - 1))] = data.draw(st.integers(0, 255))
    tags = read_tiff_tags(io.BytesIO(bytes(whole[: data.draw(st.integers(0, len(whole)))])))
    if tags is not None:
        for value in (*tags.main.values(), *tags.exif.values(), *tags.gps.values()):
            assert isinstance(value, str | bytes | tuple)
            if isinstance(value, tuple):
                assert all(v is None or isinstance(v, int | float | Fraction) for v in value)


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=200), st.sampled_from([b"II*\0", b"MM\0*", b"II+\0", b"IIU\0"]))
@example(
    struct.pack("<I", 8) + struct.pack("<HHHI4s", 65535, 0x8769, 4, 1, b"\x08\0\0\0"), b"II*\0"
)
def test_arbitrary_bytes_are_read_without_error(
    tmp_path_factory: pytest.TempPathFactory, data: bytes, head: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.nef"
    path.write_bytes(head + data)
    found = read_exif(path)
    assert found.relative_exposure is None or found.relative_exposure > 0


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_damaged_files(files: list[Path], tmp_path_factory, data: st.DataObject) -> None:
    source = data.draw(st.sampled_from(files))
    whole = bytearray(source.read_bytes())
    for _ in range(data.draw(st.integers(0, 4))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / f"damaged{source.suffix}"
    path.write_bytes(bytes(whole[: data.draw(st.integers(0, len(whole)))]))
    found = read_exif(path)
    assert found.latitude is None or abs(found.latitude) <= 90


def test_aerial_photo(shared: Path) -> None:
    found = read_exif(shared / "data/real/brighton_sun.jpg")
    assert found.datetime_original == datetime(2016, 6, 23, 16, 33, 18)
    assert found.offset_original is None and found.utc is None  # no time zone is stored
    assert found.latitude == pytest.approx(46 + 50 / 60 + 32.7621 / 3600, abs=1e-7)
    assert found.longitude == pytest.approx(-(91 + 59 / 60 + 39.6002 / 3600), abs=1e-7)
    assert found.altitude == pytest.approx(198.609)
    assert (found.make, found.model) == ("DJI", "FC300S")
    assert found.relative_exposure == pytest.approx(0.002129 / 2.8**2, rel=1e-3)


def test_photos_of_one_manual_exposure(shared: Path) -> None:
    photos = sorted((shared / "data/real/rodin_bronze/photos").glob("*.jpg"))
    found = [read_exif(path) for path in photos]
    assert len(found) == 16
    assert {(f.exposure_time, f.f_number, f.iso) for f in found} == {(1 / 125, 13.0, 200.0)}
    assert {f.model for f in found} == {"Canon EOS 5DS R"}
