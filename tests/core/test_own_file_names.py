"""File names in a .blend that Patina accepts as its own: those it generates, and no others."""

from __future__ import annotations

import os
from pathlib import PurePosixPath, PureWindowsPath

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patina.core.appearance import osl_atlas
from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.errors import PatinaError
from patina.core.photo import write_exr, write_png

VALID = "patina_components_0123456789ab.exr"


def test_generated_names_are_accepted(tmp_path):
    basis = default_basis()
    brdf = PrincipalBRDF(basis, np.zeros((3, 5)))
    made = (
        osl_atlas.components_name(basis),
        osl_atlas.remainder_name(brdf),
        osl_atlas.sampling_name(brdf),
    )
    assert all(osl_atlas.is_own_name(name) for name in made), made
    path = osl_atlas.write_picture(tmp_path / made[1], np.ones((2, 2, 3), np.float32))
    assert path.read_bytes().startswith(osl_atlas.EXR_MAGIC)


@given(st.sampled_from(["components", "brdf", "sampling"]), st.integers(0, 16**12 - 1))
def test_all_digests_are_accepted(kind, number):
    assert osl_atlas.is_own_name(f"patina_{kind}_{number:012x}.exr")


@given(
    st.text() | st.builds(lambda a, b: a + VALID + b, st.text(), st.text())
    | st.builds(lambda i, c: VALID[:i] + c + VALID[i:], st.integers(0, len(VALID)), st.text())
)  # fmt: skip
def test_accepted_names_are_bare_names_on_every_platform(name):
    if osl_atlas.is_own_name(name):
        assert PurePosixPath(name).name == PureWindowsPath(name).name == name
        assert name.isascii() and name.endswith(".exr") and len(name) < 40
        assert not PureWindowsPath(name).drive


@pytest.mark.parametrize(
    "name",
    [
        "../../evil.pth", "/tmp/" + VALID, "../" + VALID, "..\\" + VALID, "C:" + VALID,
        VALID + "\n", VALID + "/", VALID + ":stream", VALID.upper(), VALID[:-4] + ".pth",
        VALID.replace("0", "g"), VALID.replace("0", "\u0660"), "", ".", "..", None, 7, [VALID],
        VALID.encode(),
    ],
)  # fmt: skip
def test_other_names_are_rejected(name):
    assert not osl_atlas.is_own_name(name)


@pytest.mark.skipif(os.name == "nt", reason="links need a right of their own on Windows")
def test_images_are_not_written_through_links(tmp_path):
    victim = tmp_path / "victim"
    victim.write_bytes(b"before")
    for name in ("a.exr", "a.exr.part", "a.part.exr", "a.exr.part.exr", "a.png"):
        (tmp_path / name).symlink_to(victim)
    write_exr(tmp_path / "a.exr", np.ones((2, 2, 3), np.float32))
    assert not (tmp_path / "a.exr").is_symlink()  # the link itself was replaced
    with pytest.raises(PatinaError, match="symbolic link"):
        write_png(tmp_path / "a.png", np.ones((2, 2), np.uint8))
    assert victim.read_bytes() == b"before"
