"""Damaged, hostile or contradictory cameras.xml files: a one-line error in bounded time."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError, PatinaError
from patina.core.scan.formats import read_reconstruction
from patina.core.scan.parsing import xml_file
from patina.core.scan.parsing.xml_file import line_of, read_xml
from tests import make_metashape as made

SECONDS = 5.0


@pytest.fixture(scope="module")
def good():
    return made.document(made.chunk_xml(made.scene("2.0.0")))


def error_line(folder, data, match, seconds=SECONDS):
    """Return the error's single line, which names the file."""
    path = folder / "cameras.xml"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    started = time.process_time()
    with pytest.raises(InputError, match=match) as raised:
        read_reconstruction(path)
    assert time.process_time() - started < seconds
    message = str(raised.value)
    assert message.startswith(str(path)) and "\n" not in message
    return message


def check_survives(path):
    started = time.process_time()
    try:
        found = read_reconstruction(path)
    except PatinaError as error:
        assert "\n" not in str(error) and str(path) in str(error)
    else:
        for camera in found.cameras:
            assert np.isfinite(camera.parameters).all()
            assert np.isfinite(camera.pose.rotation).all()
            camera.project(np.ones((1, 3)))
    assert time.process_time() - started < SECONDS


# ------------------------------------------------------------------------------- generic XML


def test_file_truncated_at_any_place(tmp_path, good):
    data = good.encode()
    for at in np.random.default_rng(0).integers(0, len(data) - 20, 50):
        error = error_line(tmp_path, data[:at], "is not valid XML")
        assert re.match(r".*cameras\.xml:\d+: ", error)


def test_encodings(tmp_path, good):
    head = '<?xml version="1.0" encoding="{}"?>'
    body = good.removeprefix(made.HEAD).replace("Chunk 1", "Büste")
    error_line(tmp_path, (head.format("UTF-8") + body).encode("latin-1"), "invalid token")
    error_line(tmp_path, (head.format("UTF-16") + body).encode(), "encoding specified")
    error_line(tmp_path, (head.format("klingon") + body).encode(), "unknown encoding: klingon")
    error_line(tmp_path, (head.format("shift_jis") + body).encode(), "expected UTF-8")
    error_line(tmp_path, b"\0" * 1000, "is not valid XML")
    error_line(tmp_path, b"", "no element found")
    for encoding in ("UTF-8", "UTF-16", "ISO-8859-1", "windows-1252"):
        path = tmp_path / "good.xml"
        path.write_bytes((head.format(encoding) + body).encode(encoding))
        assert len(read_reconstruction(path).cameras) > 10
    path.write_bytes(b"\xef\xbb\xbf" + (head.format("UTF-8") + body).encode())
    assert len(read_reconstruction(path).cameras) > 10


NESTED_ENTITIES = "".join(f'<!ENTITY a{i + 1} "{f"&a{i};" * 10}">' for i in range(9))
BOMBS = {
    "billion laughs": f'<!DOCTYPE d [<!ENTITY a0 "ha">{NESTED_ENTITIES}]><document>&a9;</document>',
    "quadratic blowup": f'<!DOCTYPE d [<!ENTITY a "{"x" * 50000}">]><document>{"&a;" * 50000}'
    "</document>",
    "external entity": '<!DOCTYPE d [<!ENTITY a SYSTEM "file:///etc/passwd">]><document>&a;'
    "</document>",
    "external document type": '<!DOCTYPE d SYSTEM "http://127.0.0.1:9/x.dtd"><document/>',
    "parameter entity": '<!DOCTYPE d [<!ENTITY % a SYSTEM "file:///etc/passwd">%a;]><document/>',
}


@pytest.mark.parametrize("name", BOMBS)
def test_entity_expansion_bombs(tmp_path, name):
    error = error_line(tmp_path, made.HEAD + BOMBS[name], "declares a document type")
    assert "cameras.xml:2:" in error


def test_deep_nesting_and_long_numbers(tmp_path):
    error_line(tmp_path, "<document>" + "<chunk>" * 100_000, "nested more than 100 deep")
    groups = "<group>" * 50_000 + "</group>" * 50_000
    error_line(
        tmp_path, f"<document><chunk><cameras>{groups}</cameras></chunk></document>", "nested"
    )
    attributes = " ".join(f'a{i}="1"' for i in range(100_000))
    error_line(tmp_path, f"<document {attributes}/>", "holds no chunk")


def test_size_limits(tmp_path, monkeypatch):
    monkeypatch.setattr(xml_file, "MAX_ELEMENTS", 1000)
    error_line(
        tmp_path, "<document>" + "<a/>" * 1000 + "</document>", "holds more than 1,000 elements"
    )
    monkeypatch.setattr(xml_file, "MAX_XML_BYTES", 1 << 20)
    error_line(tmp_path, b"<document>" + b" " * (1 << 20) + b"</document>", "too large")


@pytest.mark.slow
def test_large_document_in_bounded_time_and_memory(tmp_path):
    resource = pytest.importorskip("resource")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    many = "<document>" + "<a/>" * 1_100_000 + "</document>"
    error_line(tmp_path, many, "1,000,000 elements", seconds=15)  # 3 s on an idle machine
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before  # kB
    assert grown < 1 << 19


def test_errors_name_line_of_element():
    root = read_xml(b"<a>\n<b/>\n\n<c><d/></c></a>", "f.xml")
    assert [line_of(e) for e in root.iter()] == [1, 2, 4, 4]
    assert line_of(None) is None
    with pytest.raises(InputError, match=r"^f\.xml:2: is not valid XML \(mismatched tag\)"):
        read_xml(b"<a>\n</b>", "f.xml")


def test_folder_and_missing_file_are_rejected(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_xml(tmp_path)
    with pytest.raises(InputError, match="cannot be read"):
        read_xml(tmp_path / "none.xml")


# --------------------------------------------------------- contents that Metashape never writes


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ("<calibration/>", "is a lens calibration, not a Metashape <document>"),
        ("<BlocksExchange/>", "is a <BlocksExchange>, not a Metashape <document>"),
        ("<document/>", "holds no chunk"),
        ("<document><chunk/></document>", "holds no cameras; expected a chunk with aligned photos"),
    ],
)
def test_other_xml_documents_are_rejected(tmp_path, data, expected):
    error_line(tmp_path, data, expected)


def scene(**sensor):
    made_scene = made.simple()
    made_scene.sensors[0].values = {**made_scene.sensors[0].values, **sensor}
    return made.document(made.chunk_xml(made_scene))


MATRIX = re.compile(r"(<camera [^>]*><transform>)[^<]*")


@pytest.mark.parametrize(
    ("matrix", "expected"),
    [
        ("nan " * 16, "<transform> holds 'nan nan .*; expected 16 finite numbers"),
        ("inf " * 16, "expected 16 finite numbers"),
        ("1e999 " * 16, "expected 16 finite numbers"),
        ("1 0 0", "expected 16 finite numbers"),
        ("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 7", "expected 16 finite numbers"),
        ("a b c", "<transform> holds 'a b c'; expected 16 finite numbers"),
        ("0 " * 16, "transform that is not rigid"),
        ("1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1", "transform that is not rigid"),
        ("2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1", "transform that is not rigid"),
        ("1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1", "transform that is not rigid"),
        ("1 0 0 1e300 0 1 0 0 0 0 1 0 0 0 0 1", "has a translation of 1e.300 units"),
    ],
)
def test_invalid_poses_are_rejected(tmp_path, matrix, expected):
    data = MATRIX.sub(rf"\g<1>{matrix}", scene(), count=1)
    assert re.match(r".*cameras\.xml(:\d+)?: ", error_line(tmp_path, data, expected))


def test_empty_transform_means_unaligned_camera(tmp_path):
    path = tmp_path / "cameras.xml"
    path.write_text(MATRIX.sub(r"\g<1>", scene(), count=1))
    found = read_reconstruction(path)
    assert len(found.cameras) == 2
    assert "1 of 3 cameras left out: not aligned." in found.notes


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"f": 1e-9}, "a focal length of 1e-09 pixels"),
        ({"f": -3000.0}, "a focal length of -3000 pixels"),
        ({"f": float("nan")}, "<f> holds 'nan'; expected a finite number"),
        ({"k1": float("inf")}, "<k1> holds 'inf'"),
        ({"b1": -1e5}, "a focal length of -96400 pixels"),
        ({"k3": 1e200}, "parameter above 1e12"),
    ],
)
def test_invalid_lenses_are_rejected(tmp_path, values, expected):
    error_line(tmp_path, scene(**values), expected)


def test_zero_focal_length_is_rejected(tmp_path):
    error_line(tmp_path, scene().replace("<f>3600.0</f>", "<f>0</f>"), "a focal length of 0 pixels")


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('width="4000"', 'width="99999999999"', "a resolution of '99999999999'"),
        ('width="4000"', 'width="9999999"', "has 9999999 × 3000 pixels"),
        ('width="4000"', 'width="0"', "has 0 × 3000 pixels"),
        ('width="4000"', 'width="-5"', "a resolution of '-5' × '3000'"),
        ('width="4000"', "", "a resolution of ''"),
        ('sensor_id="0"', 'sensor_id="8"', "refers to the sensor '8', which is not in the chunk"),
        ('<sensor id="0"', '<sensor id="1"', "refers to the sensor '0', which is not in the chunk"),
        ('camera id="1"', 'camera id="0"', "two cameras with the id '0'"),
        ('camera id="1"', "camera", "a camera has no id"),
        ("</sensors>", '<sensor id="0"/></sensors>', "two sensors with the id '0'"),
        ("<calibration", "<other", "is not valid XML"),
    ],
)
def test_invalid_ids_and_sizes_are_rejected(tmp_path, old, new, expected):
    error_line(tmp_path, scene().replace(old, new), expected)


def test_missing_calibration(tmp_path):
    data = re.sub(r"<calibration.*</calibration>", "", scene())
    error_line(tmp_path, data, "'lens' has no calibration with a focal length")
    # only the sensor of a camera needs one: Metashape keeps sensors of photos that were removed
    path = tmp_path / "cameras.xml"
    path.write_text(scene().replace("</sensors>", '<sensor id="9" label="ghost"/></sensors>'))
    assert len(read_reconstruction(path).cameras) == 3


def test_invalid_masters_are_rejected(tmp_path):
    chunk = made.simple()
    chunk.cameras[0].master, chunk.cameras[1].master = 1, 0
    error_line(tmp_path, made.document(made.chunk_xml(chunk)), "leads back to itself")
    chunk.cameras[1].master = 55
    error_line(tmp_path, made.document(made.chunk_xml(chunk)), "'55' is not in the chunk")
    many = made.simple(300)
    for number, camera in enumerate(many.cameras[:-1]):
        camera.master = number + 1
    error_line(tmp_path, made.document(made.chunk_xml(many)), "leads back")


@pytest.mark.parametrize(
    "transform",
    [
        "<rotation>1 0 0 0 1 0 0 0 2</rotation>",
        "<rotation>nan 0 0 0 1 0 0 0 1</rotation>",
        "<rotation>1 0 0 0 1 0</rotation>",
        "<scale>0</scale>",
        "<scale>-1</scale>",
        "<translation>1 2</translation>",
        "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0",
    ],
)
def test_invalid_chunk_transforms_are_rejected(tmp_path, transform):
    chunk = made.chunk_xml(made.simple(), extra=f"<transform>{transform}</transform>")
    error_line(tmp_path, made.document(chunk), r"cameras\.xml:\d+: .*(expected|not a similarity)")


# -------------------------------------------------------------------------------------- fuzzing

TOKENS = [
    "nan", "-1", "0", "1e308", "99999999999999999999", "", "<", "</camera>", "<camera>", "&#0;",
    "&lt;", '"', "id=", 'master_id="0"', 'component_id="9"', "<group>", "</group>", "frame",
    "spherical", "<transform>", "</transform>", "<!DOCTYPE a>", "<![CDATA[", "\ud7ff", "\0",
]  # fmt: skip


@given(
    edits=st.lists(
        st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 30), st.sampled_from(TOKENS)),
        max_size=4,
    )
)
@example(edits=[(0.0, 0, "\0")])
@example(edits=[(0.5, 30, "nan")])
@example(edits=[(0.2, 1, "1e308")])
@example(edits=[(0.9, 0, 'master_id="0"')])
@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_fuzz_edited_text(good, tmp_path, edits):
    text = good
    for where, length, token in edits:
        at = int(where * len(text))
        text = text[:at] + token + text[at + length :]
    path = tmp_path / "fuzz.xml"
    path.write_bytes(text.encode())
    check_survives(path)


NUMBER = re.compile(r"(?<=[ >])-?\d+\.\d+(?:e-?\d+)?(?=[ <])")


@given(
    places=st.lists(st.floats(0, 1, exclude_max=True), min_size=1, max_size=5),
    values=st.lists(st.floats() | st.integers(-10, 10), min_size=1, max_size=5),
)
@example(places=[0.0], values=[0.0])
@example(places=[0.02], values=[float("nan")])
@example(places=[0.05], values=[1e300])
@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_fuzz_numbers(good, tmp_path, places, values):
    """Well-formed files in which any number is replaced by any other."""
    found = list(NUMBER.finditer(good))
    replaced = sorted({int(p * len(found)) for p in places}, reverse=True)
    text = good
    for place, value in zip(replaced, values, strict=False):
        match = found[place]
        text = f"{text[: match.start()]}{value!r}{text[match.end() :]}"
    path = tmp_path / "fuzz.xml"
    path.write_text(text)
    check_survives(path)
