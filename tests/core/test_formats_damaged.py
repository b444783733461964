"""Damaged, hostile and merely odd files of every format: one line that names the file, soon; never
another exception, a hang, or cameras that are none."""

from __future__ import annotations

import json
import random
import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError
from patina.core.scan.reconstruction import Reconstruction
from tests.damaged_formats import JSONS, NAMES, check_sound, damaged, read, write_all

fuzz = settings(
    max_examples=60, deadline=None, suppress_health_check=list(HealthCheck), derandomize=False
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of good files, one of each format, with photos."""
    return write_all(tmp_path_factory.mktemp("whole"))


def test_the_whole_files_are_read(whole: Path) -> None:
    for name in NAMES:
        found = read(whole / name, whole / "photos")
        assert isinstance(found, Reconstruction), found
        check_sound(found)


@pytest.mark.parametrize("name", NAMES)
def test_truncated(whole: Path, tmp_path: Path, name: str) -> None:
    data = (whole / name).read_bytes()
    dice = random.Random(name)
    # the very end of a text is a number that may lose digits, or a comment
    for end in sorted(dice.randrange(int(len(data) * 0.96)) for _ in range(50)):
        found = read(damaged(whole, tmp_path, name, data[:end]), whole / "photos")
        assert isinstance(found, InputError), (end, len(data))
        assert name in str(found)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-32", "cp037"])
def test_another_encoding(whole: Path, tmp_path: Path, name: str, encoding: str) -> None:
    data = (whole / name).read_text().encode(encoding)
    found = read(damaged(whole, tmp_path, name, data), whole / "photos")
    if name.endswith(".xmp") and encoding.startswith("utf-16"):
        check_sound(found)  # which XML may be in
    else:
        assert isinstance(found, InputError)


@pytest.mark.parametrize("name", NAMES)
@given(place=st.floats(0, 1, exclude_max=True), byte=st.integers(0, 255))
@example(place=0.0, byte=0)
@example(place=0.01, byte=255)
@example(place=0.5, byte=ord("e"))
@example(place=0.5, byte=ord("-"))
@example(place=0.9, byte=ord("\n"))
@fuzz
def test_a_changed_byte(whole: Path, tmp_path: Path, name: str, place: float, byte: int) -> None:
    data = bytearray((whole / name).read_bytes())
    data[int(place * len(data))] = byte
    check_sound(read(damaged(whole, tmp_path, name, bytes(data)), whole / "photos"))


ODD = (
    "nan", "NaN", "inf", "-Infinity", "1e999", "-1e999", "1e308", "1e-320", "0", "-1", "1e12",
    "999999999999", "9" * 400, "true", "null", '"x"', "[]", "{}", '""', "x", "1_0", "٣", "0x10",
    "[[[[1]]]]", '"' + "y" * 5000 + '"', "",
)  # fmt: skip
NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


@pytest.mark.parametrize("name", NAMES)
@given(place=st.floats(0, 1, exclude_max=True), odd=st.sampled_from(ODD), many=st.booleans())
@example(place=0.0, odd="999999999999", many=False)
@example(place=0.02, odd="999999999999", many=False)
@example(place=0.05, odd="nan", many=False)
@example(place=0.05, odd="0", many=True)
@example(place=0.3, odd="1e308", many=True)
@example(place=0.3, odd="1e-320", many=True)
@example(place=0.0, odd="-1", many=True)
@example(place=0.0, odd="1e12", many=True)
@fuzz
def test_odd_numbers(
    whole: Path, tmp_path: Path, name: str, place: float, odd: str, many: bool
) -> None:
    """One number of the file, or all from there on, become something else."""
    data = (whole / name).read_bytes()
    spans = [match.span() for match in NUMBER.finditer(data)]
    first = int(place * len(spans))
    for start, end in reversed(spans[first : None if many else first + 1]):
        data = data[:start] + odd.encode() + data[end:]
    check_sound(read(damaged(whole, tmp_path, name, data), whole / "photos"))


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=5,
)


@pytest.mark.parametrize("name", JSONS)
@given(data=st.data())
@fuzz
def test_a_value_of_another_type(
    whole: Path, tmp_path: Path, name: str, data: st.DataObject
) -> None:
    """Some value within the JSON is replaced by any other, or taken out."""
    content = json.loads((whole / name).read_text())
    here = content
    while True:
        keys = list(here) if isinstance(here, dict) else list(range(len(here)))
        key = data.draw(st.sampled_from(keys))
        below = here[key]
        if not isinstance(below, (dict, list)) or not below or data.draw(st.booleans()):
            break
        here = below
    if data.draw(st.booleans()):
        here[key] = data.draw(JSON_VALUES)
    else:
        del here[key]
    check_sound(read(damaged(whole, tmp_path, name, json.dumps(content).encode())))


@given(data=st.binary(max_size=400))
@example(data=b"")
@example(data=b"\x00")
@example(data=b"NVM_V3\n\n" + b"9" * 30)
@example(data=b"# Bundle file v0.3\n1e30 1\n")
@example(data=b"# Bundle file v0.3\n-1 nan\n")
@example(data=b'{"frames": 1}')
@example(data=b"[[]]")
@fuzz
def test_any_bytes(tmp_path: Path, data: bytes) -> None:
    for name in NAMES:
        path = tmp_path / name
        path.write_bytes(data)
        assert isinstance(read(path), InputError)


@pytest.mark.parametrize("name", JSONS)
def test_bombs_of_json(tmp_path: Path, name: str) -> None:
    for text in (
        "[" * 1_000_000, '{"frames":' * 100_000, '{"a":' * 500 + "1" + "}" * 500,
        '{"frames": ' + "[" * 90_000 + "]" * 90_000 + "}", '{"views": ' + "9" * 100_000 + "}",
        '{"shots": 1e999999999}', '{"frames": [' + "{}," * 200_000 + "{}]}",
        '{"extrinsics": [' + "1," * 200_000 + "1]}",
    ):  # fmt: skip
        path = tmp_path / name
        path.write_text(text)
        assert isinstance(read(path), InputError)


def test_bombs_of_xml(tmp_path: Path) -> None:
    lol = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10))
    bomb = f'<!DOCTYPE x [<!ENTITY a0 "lol">{lol}]><x>&a9;</x>'
    outside = '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><x>&a;</x>'
    for text in (bomb, outside, "<a>" * 200_000, "<a/>" * 10):
        (tmp_path / "photo.xmp").write_text(text)
        assert isinstance(read(tmp_path / "photo.xmp"), InputError)
        assert isinstance(read(tmp_path), InputError)


@pytest.mark.parametrize("count", ["1000000000000", "99999999999999999999", "1e12", "-1", "2.5"])
def test_absurd_counts(whole: Path, tmp_path: Path, count: str) -> None:
    bundle = (whole / "bundle.out").read_text().splitlines()
    nvm = (whole / "model.nvm").read_text().splitlines()
    for name, lines, at, text in (
        ("bundle.out", bundle, 1, f"{count} 12"), ("bundle.out", bundle, 1, f"8 {count}"),
        ("model.nvm", nvm, 2, count), ("model.nvm", nvm, 12, count),
    ):  # fmt: skip
        changed = [*lines[:at], text, *lines[at + 1 :]]
        data = "\n".join(changed).encode()
        assert isinstance(read(damaged(whole, tmp_path, name, data)), InputError)
