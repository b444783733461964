"""Inputs that are pipes, devices or folders are refused at once, in one sentence."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from patina.commands import command_line
from patina.commands.compare import read_truth
from patina.core.basis import storage as basis_storage
from patina.core.brdf import merl_file, nbrdf
from patina.core.capture import read_capture
from patina.core.errors import InputError
from patina.core.files import open_regular, read_regular, regular_size
from patina.core.photo.container import check_container
from patina.core.scan.formats import read_reconstruction
from patina.core.scan.mesh import read_mesh
from tests import make_capture as made

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pipes in folders")
CAMERA_FILES = (
    "cameras.xml", "bundle.out", "transforms.json", "cameras.sfm", "cameras.csv", "scan.nvm",
    "scan.psz", "scan.psx", "camera.xmp",
)  # fmt: skip


@pytest.fixture(params=["pipe", "device", "folder"])
def wrong(request, tmp_path):
    """Function: makes something that is not a regular file, of a given name."""

    def make(name: str) -> Path:
        path = tmp_path / name
        if request.param == "pipe":
            os.mkfifo(path)
        elif request.param == "device":
            path.symlink_to("/dev/zero")
        else:
            path.mkdir()
        return path

    return make


@pytest.mark.parametrize("read", [
    lambda path: read_regular(path, 10), open_regular, regular_size,
])  # fmt: skip
def test_only_regular_files_are_opened(wrong, read):
    with pytest.raises(OSError):
        read(wrong("file"))


@pytest.mark.parametrize(("name", "read"), [
    ("x.capture.toml", read_capture), ("mesh.ply", read_mesh), ("mesh.obj", read_mesh),
    ("fit.binary", merl_file.read), ("truth.json", read_truth), ("set.npz", nbrdf.load),
    ("basis.npz", basis_storage.load), ("photo.jpg", check_container), ("x.exr", check_container),
    *((name, read_reconstruction) for name in CAMERA_FILES),
])  # fmt: skip
def test_readers_refuse_what_is_not_a_regular_file(wrong, name, read):
    path = wrong(name)
    if path.is_dir() and read is read_reconstruction:
        pytest.skip("a folder may be a COLMAP model")
    with pytest.raises(InputError) as found:
        read(path)
    assert "\n" not in str(found.value)


def test_extra_cameras_that_are_a_pipe_are_refused(tmp_path, capsys):
    file = made.make_capture(tmp_path, photos=1)
    os.mkfifo(tmp_path / "more.xml")
    text = file.read_text("utf-8").replace("[scan]", '[scan]\nextra = "more.xml"', 1)
    file.write_text(text, "utf-8")
    assert command_line.main(["fit", str(file), "--out", str(tmp_path / "out")]) == 2
    assert "expected" in capsys.readouterr().err
