"""result.json read back, and all ways in which it can be invalid."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from patina.core.basis import Basis, default_basis, storage
from patina.core.errors import InputError
from patina.core.result import read_result
from tests import make_result as made


def write_one_material(folder: Path, **changes) -> Path:
    description = made.description(made.material("bronze", made.BRONZE, **changes))
    return made.write_result(folder, description)


def test_written_result_is_read_back(tmp_path: Path) -> None:
    folder = made.two_materials(tmp_path / "r")
    for path in (folder, folder / "result.json"):
        result = read_result(path)
        assert [m.name for m in result.materials] == ["bronze", "old rug"]
        assert result.basis is default_basis() and result.scene is None
        bronze = result.materials[0]
        assert np.array_equal(bronze.brdf.coefficients, made.coefficients(made.BRONZE))
        assert bronze.principled.metallic == 1.0 and bronze.principled.roughness == 0.3
        assert bronze.held_out is not None and bronze.held_out.typical == 0.05
        assert bronze.warnings == ("one", "two") and bronze.scale_known


def test_effects_are_read_with_their_parameters(tmp_path: Path) -> None:
    description = made.description(made.material("bronze", made.BRONZE))
    parameters = {"flash, right": {"value": 0.2, "standard_error": 0.1, "unit": "scan units"}}
    effect = {"cause": "flash_offset", "sentence": "It is there.", "parameters": parameters}
    description["effects"] = [effect]
    folder = made.write_result(tmp_path, description)
    assert read_result(folder).effects == {"flash_offset": {"flash, right": 0.2}}
    for wrong in ("far", [0.2], 1e12):
        parameters["flash, right"]["value"] = wrong
        made.write_result(tmp_path, description)
        with pytest.raises(InputError, match="value"):
            read_result(folder)


def test_scene_is_found_next_to_result(tmp_path: Path) -> None:
    folder = write_one_material(tmp_path)
    (folder / "scene.blend").write_bytes(b"")
    assert read_result(folder).scene == folder / "scene.blend"


def test_user_basis_is_found_by_its_version(tmp_path: Path) -> None:
    default = default_basis()
    own = Basis(
        default.grid, default.mean, default.log_reference, default.components[:5],
        default.explained, 300, "mine",
    )  # fmt: skip
    cache = tmp_path / "cache"
    cache.mkdir()
    (cache / "merl_basis_0.npz").write_bytes(b"damaged")
    storage.save(cache / "merl_basis_1.npz", own)
    stored = storage.load(cache / "merl_basis_1.npz")
    description = made.description(made.material("a", 0, coefficients=[[0.1] * 5] * 3))
    description["basis"]["version"] = stored.version
    folder = made.write_result(tmp_path / "r", description)
    assert read_result(folder, cache).materials[0].brdf.basis.provenance == "mine"
    with pytest.raises(InputError, match=r"\[basis.version\].*basis --merl") as raised:
        read_result(folder, tmp_path / "nothing")
    assert "\n" not in str(raised.value)


WRONG = [
    ({"coefficients": [[0.1], [0.1]]}, "coefficients"),
    ({"coefficients": [[0.1] * 200] * 3}, "coefficients"),
    ({"coefficients": [[0.1, 0.2], [0.1], [0.1]]}, "coefficients"),
    ({"coefficients": [[0.1, "x"], [0.1, 0.2], [0.1, 0.2]]}, "coefficients"),
    ({"coefficients": [[1e30] * 3] * 3}, "coefficients"),
    ({"coefficients": [[900.0] * 3] * 3}, "coefficients"),
    ({"coefficients": None}, "coefficients"),
    ({"name": "../../etc/passwd"}, "name"),
    ({"name": "a\nb"}, "name"),
    ({"name": ""}, "name"),
    ({"name": 7}, "name"),
    ({"principled": None}, "principled"),
    ({"principled": {**made.PRINCIPLED, "roughness": -1}}, "principled.roughness"),
    ({"principled": {**made.PRINCIPLED, "base_color": [1, 2]}}, "principled.base_color"),
    ({"principled": {**made.PRINCIPLED, "cube_root_error": "nan"}}, "principled.cube_root_error"),
    ({"held_out": 4}, "held_out"),
    ({"warnings": "none"}, "warnings"),
    ({"scale": -1}, "scale"),
]


@pytest.mark.parametrize(
    ("change", "key"), WRONG, ids=[f"{i}-{k}" for i, (_, k) in enumerate(WRONG)]
)
def test_invalid_entry_is_named(tmp_path: Path, change: dict, key: str) -> None:
    with pytest.raises(InputError) as raised:
        read_result(write_one_material(tmp_path, **change))
    assert f"materials[0].{key}" in str(raised.value)
    assert "result.json" in str(raised.value) and "\n" not in str(raised.value)


def test_invalid_files_are_rejected(tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    cases = {
        b"": "not valid JSON",
        b"[1, 2]": "expected an object",
        b"\xff\xfe\x00": "UTF-8",
        b'{"format": 3}': "another version",
        b'{"format": 2, "basis": {}}': "basis.version",
        b"[" * 100_000: "nested too deep",
        b'{"format": ' + b"9" * 10_000 + b"}": "result.json",
    }
    for content, message in cases.items():
        file.write_bytes(content)
        with pytest.raises(InputError, match=message) as raised:
            read_result(tmp_path)
        assert "\n" not in str(raised.value) and len(str(raised.value)) < 600
    file.unlink()
    for path in (tmp_path, tmp_path / "nowhere", file):
        with pytest.raises(InputError, match="does not exist"):
            read_result(path)
    file.mkdir()
    with pytest.raises(InputError, match="not a"):
        read_result(tmp_path)


def test_huge_file_is_rejected_without_reading(tmp_path: Path) -> None:
    with open(tmp_path / "result.json", "wb") as file:
        file.truncate(1 << 33)  # a sparse file
    with pytest.raises(InputError, match="too large"):
        read_result(tmp_path)


def test_duplicate_names_are_rejected(tmp_path: Path) -> None:
    description = made.description(made.material("Gold", 0), made.material("gold", 1))
    with pytest.raises(InputError, match="twice"):
        read_result(made.write_result(tmp_path, description))


PLACES = st.sampled_from(
    [("format",), ("basis",), ("basis", "version"), ("materials",), ("capture",), ("program",)]
    + [("materials", 0)]
    + [
        ("materials", 0, key)
        for key in ("name", "coefficients", "principled", "held_out", "scale", "scale_known",
                    "warnings", "estimator")
    ]
    + [("materials", 0, "coefficients", 0), ("materials", 0, "coefficients", 0, 0)]
    + [("materials", 0, "principled", key) for key in made.PRINCIPLED]
)  # fmt: skip
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=40),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=3)
    ),
    max_leaves=6,
)


@given(place=PLACES, value=VALUES)
@example(place=("materials", 0, "name"), value="\ud800")
@example(place=("basis", "version"), value="x\r\ny")
@example(place=("materials", 0, "coefficients"), value=[[], [], []])
@example(place=("materials", 0, "coefficients"), value=[[[1]], [[1]], [[1]]])
@example(place=("materials", 0, "principled", "roughness"), value=float("nan"))
@example(place=("materials", 0, "scale"), value=10**400)
@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_any_value_is_read_or_rejected_in_one_line(tmp_path: Path, place, value) -> None:
    description = made.description(made.material("a", 0, coefficients=[[0.1, 0.2]] * 3))
    description = json.loads(json.dumps(description))
    holder = description
    for key in place[:-1]:
        holder = holder[key]
    holder[place[-1]] = value
    (tmp_path / "result.json").write_text(json.dumps(description), "utf-8")
    try:
        result = read_result(tmp_path, tmp_path / "nothing")
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert np.isfinite(result.materials[0].brdf.coefficients).all()


@given(cut=st.integers(0, 2000), byte=st.integers(0, 255))
@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_damaged_bytes_are_read_or_rejected(tmp_path: Path, cut: int, byte: int) -> None:
    description = made.description(made.material("a", 0, coefficients=[[0.1, 0.2]] * 3))
    content = bytearray(json.dumps(description).encode())
    cut %= len(content)
    for damaged in (bytes(content[:cut]), bytes([*content[:cut], byte, *content[cut + 1 :]])):
        (tmp_path / "result.json").write_bytes(damaged)
        try:
            read_result(tmp_path, tmp_path / "nothing")
        except InputError as error:
            assert "\n" not in str(error)
