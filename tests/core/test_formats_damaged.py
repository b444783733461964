"""Damaged, hostile and unusual files of every format: a quick one-line error names the file; never
another exception, a hang or an invalid camera."""

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

fuzz = settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))


@pytest.fixture(scope="module")
def valid_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one valid file of each format, and the photos."""
    return write_all(tmp_path_factory.mktemp("whole"))


def test_valid_files_are_read(valid_files: Path) -> None:
    for name in NAMES:
        found = read(valid_files / name, valid_files / "photos")
        assert isinstance(found, Reconstruction), found
        check_sound(found)


@pytest.mark.parametrize("name", NAMES)
def test_truncated_files_are_rejected(valid_files: Path, tmp_path: Path, name: str) -> None:
    data = (valid_files / name).read_bytes()
    rng = random.Random(name)
    # truncation near the end may only shorten the last number or a comment
    for end in sorted(rng.randrange(int(len(data) * 0.96)) for _ in range(50)):
        found = read(damaged(valid_files, tmp_path, name, data[:end]), valid_files / "photos")
        assert isinstance(found, InputError), (end, len(data))
        assert name in str(found)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-32", "cp037"])
def test_files_in_another_encoding_are_rejected(
    valid_files: Path, tmp_path: Path, name: str, encoding: str
) -> None:
    data = (valid_files / name).read_text().encode(encoding)
    found = read(damaged(valid_files, tmp_path, name, data), valid_files / "photos")
    if name.endswith(".xmp") and encoding.startswith("utf-16"):
        check_sound(found)  # XML may be encoded in UTF-16
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
def test_changed_byte_gives_an_error_or_valid_cameras(
    valid_files: Path, tmp_path: Path, name: str, place: float, byte: int
) -> None:
    data = bytearray((valid_files / name).read_bytes())
    data[int(place * len(data))] = byte
    check_sound(read(damaged(valid_files, tmp_path, name, bytes(data)), valid_files / "photos"))


UNUSUAL_NUMBERS = (
    "nan", "NaN", "inf", "-Infinity", "1e999", "-1e999", "1e308", "1e-320", "0", "-1", "1e12",
    "999999999999", "9" * 400, "true", "null", '"x"', "[]", "{}", '""', "x", "1_0", "٣", "0x10",
    "[[[[1]]]]", '"' + "y" * 5000 + '"', "",
)  # fmt: skip
NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


@pytest.mark.parametrize("name", NAMES)
@given(
    place=st.floats(0, 1, exclude_max=True),
    odd=st.sampled_from(UNUSUAL_NUMBERS),
    many=st.booleans(),
)
@example(place=0.0, odd="999999999999", many=False)
@example(place=0.02, odd="999999999999", many=False)
@example(place=0.05, odd="nan", many=False)
@example(place=0.05, odd="0", many=True)
@example(place=0.3, odd="1e308", many=True)
@example(place=0.3, odd="1e-320", many=True)
@example(place=0.1015625, odd="1e-320", many=False)
@example(place=0.0, odd="-1", many=True)
@example(place=0.0, odd="1e12", many=True)
@fuzz
def test_unusual_numbers_give_an_error_or_valid_cameras(
    valid_files: Path, tmp_path: Path, name: str, place: float, odd: str, many: bool
) -> None:
    """One number of the file, or all numbers from there on, are replaced by an unusual value."""
    data = (valid_files / name).read_bytes()
    spans = [match.span() for match in NUMBER.finditer(data)]
    first = int(place * len(spans))
    for start, end in reversed(spans[first : None if many else first + 1]):
        data = data[:start] + odd.encode() + data[end:]
    check_sound(read(damaged(valid_files, tmp_path, name, data), valid_files / "photos"))


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=5,
)


@pytest.mark.parametrize("name", JSONS)
@given(data=st.data())
@fuzz
def test_json_value_of_another_type_gives_an_error_or_valid_cameras(
    valid_files: Path, tmp_path: Path, name: str, data: st.DataObject
) -> None:
    """A random value within the JSON is replaced by another one, or deleted."""
    content = json.loads((valid_files / name).read_text())
    container = content
    while True:
        keys = list(container) if isinstance(container, dict) else list(range(len(container)))
        key = data.draw(st.sampled_from(keys))
        child = container[key]
        if not isinstance(child, (dict, list)) or not child or data.draw(st.booleans()):
            break
        container = child
    if data.draw(st.booleans()):
        container[key] = data.draw(JSON_VALUES)
    else:
        del container[key]
    check_sound(read(damaged(valid_files, tmp_path, name, json.dumps(content).encode())))


@given(data=st.binary(max_size=400))
@example(data=b"")
@example(data=b"\x00")
@example(data=b"NVM_V3\n\n" + b"9" * 30)
@example(data=b"# Bundle file v0.3\n1e30 1\n")
@example(data=b"# Bundle file v0.3\n-1 nan\n")
@example(data=b'{"frames": 1}')
@example(data=b"[[]]")
@fuzz
def test_random_bytes_are_rejected(tmp_path: Path, data: bytes) -> None:
    for name in NAMES:
        path = tmp_path / name
        path.write_bytes(data)
        assert isinstance(read(path), InputError)


@pytest.mark.parametrize("name", JSONS)
def test_excessive_json_is_rejected(tmp_path: Path, name: str) -> None:
    for text in (
        "[" * 1_000_000, '{"frames":' * 100_000, '{"a":' * 500 + "1" + "}" * 500,
        '{"frames": ' + "[" * 90_000 + "]" * 90_000 + "}", '{"views": ' + "9" * 100_000 + "}",
        '{"shots": 1e999999999}', '{"frames": [' + "{}," * 200_000 + "{}]}",
        '{"extrinsics": [' + "1," * 200_000 + "1]}",
    ):  # fmt: skip
        path = tmp_path / name
        path.write_text(text)
        assert isinstance(read(path), InputError)


def test_xml_entity_bombs_are_rejected(tmp_path: Path) -> None:
    entities = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10))
    bomb = f'<!DOCTYPE x [<!ENTITY a0 "lol">{entities}]><x>&a9;</x>'
    external_entity = '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><x>&a;</x>'
    for text in (bomb, external_entity, "<a>" * 200_000, "<a/>" * 10):
        (tmp_path / "photo.xmp").write_text(text)
        assert isinstance(read(tmp_path / "photo.xmp"), InputError)
        assert isinstance(read(tmp_path), InputError)


@pytest.mark.parametrize("count", ["1000000000000", "99999999999999999999", "1e12", "-1", "2.5"])
def test_impossible_counts_are_rejected(valid_files: Path, tmp_path: Path, count: str) -> None:
    bundle = (valid_files / "bundle.out").read_text().splitlines()
    nvm = (valid_files / "model.nvm").read_text().splitlines()
    for name, lines, at, text in (
        ("bundle.out", bundle, 1, f"{count} 12"), ("bundle.out", bundle, 1, f"8 {count}"),
        ("model.nvm", nvm, 2, count), ("model.nvm", nvm, 12, count),
    ):  # fmt: skip
        changed = [*lines[:at], text, *lines[at + 1 :]]
        data = "\n".join(changed).encode()
        assert isinstance(read(damaged(valid_files, tmp_path, name, data)), InputError)
