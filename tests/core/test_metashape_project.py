"""Metashape projects (.psx with its folder, .psz): valid, moved to another place, and hostile."""

from __future__ import annotations

import io
import shutil
import struct
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError, PatinaError
from patina.core.scan.formats import read_reconstruction
from patina.core.scan.readers import metashape_zip
from tests import make_metashape as made

SECONDS = 5.0


@pytest.fixture()
def scene():
    return made.scene("2.0.0")


def error_line(path, match, **more):
    started = time.process_time()
    with pytest.raises(InputError, match=match) as raised:
        read_reconstruction(path, **more)
    assert time.process_time() - started < SECONDS
    assert "\n" not in str(raised.value)
    return str(raised.value)


@pytest.mark.parametrize("kind", ["psx", "psz"])
def test_round_trip(tmp_path, scene, kind):
    chunk = made.chunk_xml(scene)
    photos = {0: "../../../photos/IMG_0000.JPG", 1: "C:/shoot/IMG_0001.JPG", 2: "/net/2.JPG"}
    if kind == "psx":
        path = made.write_psx(tmp_path, "my scan", [chunk], photos)
        relative_path = "../../../photos/IMG_0000.JPG"
        assert (tmp_path / "my scan.files" / "0" / "0" / relative_path).resolve().parent == (
            tmp_path / "photos"
        )
    else:
        photos[0] = "photos/IMG_0000.JPG"
        path = made.write_psz(tmp_path / "my scan.psz", [chunk], photos)
    found = read_reconstruction(path)
    made.agree(found, scene)
    written = {c.label: c.photo for c in found.cameras}
    assert Path(written["IMG_0000"]) == tmp_path / "photos" / "IMG_0000.JPG"
    assert written["IMG_0001"] == "C:/shoot/IMG_0001.JPG"
    assert written["IMG_0002"] == "/net/2.JPG"
    assert written["IMG_0003"] is None
    assert any("Export Model" in note for note in found.notes)


def test_psz_with_nested_documents(tmp_path, scene):
    chunk = made.chunk_xml(scene).replace(
        "</chunk>", '<frames><frame id="0" path="0/doc.xml"/></frames></chunk>'
    )
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as archive:
        archive.writestr("doc.xml", chunk)
    listed = '<document><chunks><chunk id="0" path="0/chunk.zip"/></chunks></document>'
    path = made.write_zip(
        tmp_path / "a.psz",
        {
            "doc.xml": listed,
            "0/chunk.zip": inner.getvalue(),
            "0/0/doc.xml": made.frame_xml({0: "a.jpg"}),
        },
    )
    found = read_reconstruction(path)
    made.agree(found, scene)
    assert found.cameras[0].photo == str(tmp_path / "0" / "0" / "a.jpg")


def test_chunks_of_a_project(tmp_path):
    chunks = []
    for label in ("a", "b"):
        scene = made.simple()
        scene.label = label
        for camera in scene.cameras:
            camera.label = label + camera.label
        chunks.append(made.chunk_xml(scene))
    path = made.write_psx(tmp_path, "p", chunks, active=1)
    assert read_reconstruction(path).cameras[0].label == "bIMG_0000"
    assert read_reconstruction(path, chunk="a").cameras[0].label == "aIMG_0000"
    error_line(path, "no chunk 'c'; expected one of 'a', 'b'", chunk="c")


def test_missing_project_folder_is_rejected(tmp_path, scene):
    path = made.write_psx(tmp_path, "p", [made.chunk_xml(scene)])
    lonely = tmp_path / "other.psx"
    shutil.copy(path, lonely)
    error_line(lonely, "its folder 'other.files' with 'project.zip' is missing")
    shutil.rmtree(tmp_path / "p.files" / "0")
    error_line(path, r"its chunk '0' is missing; expected the file 'p.files/0/chunk.zip'")


def test_missing_frame_document_leaves_photos_unknown(tmp_path, scene):
    path = made.write_psx(tmp_path, "p", [made.chunk_xml(scene)], {0: "a.jpg"})
    shutil.rmtree(tmp_path / "p.files" / "0" / "0")
    found = read_reconstruction(path)
    assert all(c.photo is None for c in found.cameras)
    assert any("paths of the photos are unknown" in note for note in found.notes)


@pytest.mark.parametrize(
    "place",
    [
        "../secret.zip",
        "/etc/passwd",
        "C:/x.zip",
        "..\\..\\x.zip",
        "\\\\host\\share\\x.zip",
        "a/../../x.zip",
        ".",
        "a\0b",
    ],
)
def test_paths_must_stay_inside_project(tmp_path, scene, place):
    made.write_zip(tmp_path / "secret.zip", {"doc.xml": made.chunk_xml(scene)})
    path = tmp_path / "in" / "p.psx"
    path.parent.mkdir()
    listed = f'<document><chunks><chunk id="0" path="{place}"/></chunks></document>'
    if "\0" not in place:
        path.write_text(f'<document path="{place}"/>')
        error_line(path, "leads outside the project's folder")
        path.write_text('<document path="{projectname}.files/project.zip"/>')
        made.write_zip(path.parent / "p.files" / "project.zip", {"doc.xml": listed})
        error_line(path, "leads outside the project's folder")
        psz = made.write_zip(path.parent / "p.psz", {"doc.xml": listed})
        error_line(psz, "leads outside the project's folder")
    else:
        path.write_text(f'<document path="{place}"/>')
        error_line(path, "is not valid XML")


def test_impossible_file_name_is_rejected(tmp_path):
    path = tmp_path / "p.psx"
    path.write_text(f'<document path="{"x" * 5000}/project.zip"/>')
    error_line(path, "is missing; copy the folder")


def bomb(size, method=zipfile.ZIP_DEFLATED):
    """A zip whose doc.xml unpacks to ``size`` bytes without content."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", method) as archive, archive.open("doc.xml", "w") as entry:
        for _ in range(size >> 20):
            entry.write(b" " * (1 << 20))
    return packed.getvalue()


def test_zip_bombs(tmp_path):
    path = tmp_path / "p.psz"
    path.write_bytes(bomb(64 << 20))
    error_line(path, "unpacks to 64 MB")
    path.write_bytes(bomb(3 << 20, zipfile.ZIP_LZMA))
    error_line(path, "unpacks to 3 MB|compressed with method")
    inner = bomb(64 << 20)
    listed = '<document><chunks><chunk id="0" path="0.zip"/></chunks></document>'
    made.write_zip(path, {"doc.xml": listed, "0.zip": inner})
    error_line(path, "unpacks to 64 MB")


def test_zip_with_false_uncompressed_size(tmp_path):
    data = bytearray(bomb(64 << 20))
    start = data.rindex(b"PK\x01\x02")
    struct.pack_into("<I", data, start + 24, 100)  # uncompressed size in the central directory
    path = tmp_path / "p.psz"
    path.write_bytes(data)
    error_line(path, "p.psz")


def test_many_large_documents_hit_total_limit(tmp_path, monkeypatch):
    from patina.core.scan.readers import metashape_project

    chunk = made.chunk_xml(made.simple(), extra="<x>" + "y" * 5000 + "</x>")
    listed = "".join(f'<chunk id="{i}" path="0.xml"/>' for i in range(100))
    path = made.write_zip(
        tmp_path / "p.psz",
        {"doc.xml": f"<document><chunks>{listed}</chunks></document>", "0.xml": chunk},
    )
    monkeypatch.setattr(metashape_project, "MAX_TOTAL_BYTES", 20 * len(chunk))
    error_line(path, "too large for a Metashape project")


def test_too_long_file_list_is_rejected(tmp_path, scene, monkeypatch):
    path = made.write_psz(tmp_path / "p.psz", [made.chunk_xml(scene)])
    monkeypatch.setattr(metashape_zip, "MAX_DIRECTORY_BYTES", 10)
    error_line(path, "lists too many files")


def test_zip64_file_list(tmp_path, scene):
    """Zips beyond 4 GB store the list's size in a zip64 record; here a small one has it too."""
    path = made.write_psz(tmp_path / "p.psz", [made.chunk_xml(scene)])
    data = path.read_bytes()
    at = data.rindex(b"PK\x05\x06")
    (entries, size, start) = struct.unpack_from("<HII", data, at + 10)
    end64 = struct.pack(
        "<4sQHHIIQQQQ", b"PK\x06\x06", 44, 45, 45, 0, 0, entries, entries, size, start
    )
    locator = struct.pack("<4sIQI", b"PK\x06\x07", 0, at, 1)
    end = struct.pack("<4sHHHHIIH", b"PK\x05\x06", 0, 0, 0xFFFF, 0xFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0)
    path.write_bytes(data[:at] + end64 + locator + end)
    made.agree(read_reconstruction(path), scene)


@pytest.mark.parametrize("name", ["empty.psz", "text.psz", "empty.psx"])
def test_file_that_is_no_project(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"" if "empty" in name else b"hello, world" * 100)
    error_line(path, name)


def test_zip_without_document_is_rejected(tmp_path):
    error_line(made.write_zip(tmp_path / "p.psz", {"other.xml": "<a/>"}), "holds no doc.xml")
    error_line(
        made.write_zip(tmp_path / "q.psz", {"doc.xml": "<a/>"}), "not a Metashape <document>"
    )
    psx = tmp_path / "r.psx"
    psx.write_text("<document version='1.2.0'/>")
    error_line(psx, "is not a Metashape project")


def check_survives(path):
    """Read, or reject with one line, in bounded time."""
    started = time.process_time()
    try:
        found = read_reconstruction(path)
    except PatinaError as error:
        assert "\n" not in str(error) and path.stem in str(error)
    else:
        assert len(found.cameras) > 0
        assert all(np.isfinite(c.pose.translation).all() for c in found.cameras)
    assert time.process_time() - started < SECONDS


@pytest.fixture(scope="module")
def packed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fuzz")
    return made.write_psz(folder / "p.psz", [made.chunk_xml(made.simple())], {0: "a.jpg"})


def test_project_truncated_at_any_place(packed, tmp_path):
    data = packed.read_bytes()
    for at in np.random.default_rng(0).integers(0, len(data), 50):
        path = tmp_path / "cut.psz"
        path.write_bytes(data[:at])
        check_survives(path)


@given(
    changes=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), max_size=8)
)
@example(changes=[(0.999, 0xFF)])
@example(changes=[(0.99, 0xFF), (0.985, 0xFF)])
@example(changes=[(0.0, 0)])
@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_fuzz_bytes_of_a_project(packed, tmp_path, changes):
    data = bytearray(packed.read_bytes())
    for where, value in changes:
        data[int(where * len(data))] = value
    path = tmp_path / "fuzz.psz"
    path.write_bytes(data)
    check_survives(path)
