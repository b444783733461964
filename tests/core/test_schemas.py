"""The JSON Schemas in assets/schemas describe what Patina reads and writes, and nothing else."""

from __future__ import annotations

import copy
import json
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator, FormatChecker

from patina.core.capture import read_capture
from patina.core.capture.section import Section
from patina.core.diagnose import effects
from patina.core.errors import InputError
from patina.core.jobs import FitJob
from patina.core.jobs.check_job import CheckJob
from patina.core.report import diagnosis_json, result_json
from tests import make_capture as made

EVERY_KEY = """
[scan]
cameras = "sparse"
mesh = "mesh.ply"
images = "."
chunk = "Chunk 1"
frame = "chunk"
extra = "mesh.ply"
texture = "lit_1.exr"

[tone]
transfer = "auto"
chart = {photo = "lit_1.exr", corners = [[1, 1], [9, 1]], reflectance = [0.9, 0.1], \
light = "lamp", normal = [0, 0, 1]}

[[light]]
name = "lamp"
direction = [0.3, 0.5, 0.81]
angle = 0.53
relative_strength = 1.5
refine = false

[[light]]
name = "ball"
sphere = {photo = "lit_1.exr", camera = "view_01.jpg", center = [60, 45], radius = 40, \
surface = "chrome", reflectance = 0.6}

[[light]]
name = "masked ball"
sphere = {photo = "lit_1.exr", camera = "view_01.jpg", mask = "lit_2.exr", surface = "glossy"}
irradiance = [3, 3, 3]

[[light]]
name = "sun"
sun = {latitude = 48.1, longitude = 11.6, altitude = 500, time = 2018-06-01T12:00:00+02:00, \
north = [0, 1, 0], up = [0, 0, 1]}
white = {photo = "lit_1.exr", mask = "lit_2.exr", reflectance = 0.9, normal = [0, 0, 1], \
exposure = 1.0}

[[light]]
name = "near"
position = [0.4, -1.2, 2.0]
intensity = [12, 12, 12]
radius = 0.05
refine = true

[[light]]
name = "flash"
mounted = [0.0, -0.12, 0.0]
intensity = [12, 12, 12]
beam = 40
standard_error = 0.1

[[photo]]
file = "lit_1.exr"
camera = "view_01.jpg"
light = "lamp"
exposure = 1.0
transfer = "linear"
saturation = 4.0
masks = {gold = "lit_2.exr", shadow = "lit_3.exr"}

[[photo]]
file = ["lit_2.exr", "lit_3.exr"]
camera = "view_02.jpg"
light = "lamp"
exposure = [1.0, 4.0]

[[material]]
name = "gold"

[[material]]
name = "part"
faces = "part"

[[material]]
name = "painted"
vertex_colour = [200, 30, 30]

[[material]]
name = "textured"
texture_colour = [200, 30, 30]

[fit]
method = "paper"
absolute = true
silhouette_margin = 2
shadow_margin = 3
mask_margin = 1
smallest_cosine = 0.1
held_out = true
samples = 6
trials = 10
subset = 1000
curvature = 0.2
monotonicity = true
highest_intensity = true
eta = 40.0
seed = 0

[diagnose]
"""
"""Every key that the reader knows, in at least one table."""

MISTAKES: dict[str, tuple[str, str]] = {
    "a missing key": ('camera = "view_01.jpg"\nlight = "lamp"', 'light = "lamp"'),
    "two ways to give a light": ("position = [", "direction = [0, 0, 1]\nposition = ["),
    "no way to give a light": ("position = [0.4, -1.2, 2.0]\n", ""),
    "irradiance of a near lamp": ("intensity = [12", "irradiance = [12"),
    "a negative intensity": ("intensity = [12", "intensity = [-12"),
    "two numbers for a vector": ("direction = [0.3, 0.5, 0.81]", "direction = [0.3, 0.5]"),
    "a text for a number": ("samples = 6", 'samples = "six"'),
    "an unknown method": ('method = "paper"', 'method = "guess"'),
    "a number out of range": ("smallest_cosine = 0.1", "smallest_cosine = 2"),
    "latitude alone": ("longitude = 11.6, ", ""),
    "two colours of a material": ("vertex_colour", "faces = 'x'\nvertex_colour"),
    "an unknown surface": ('surface = "glossy"', 'surface = "matte"'),
    "no photo": ("[[photo]]", "[[other]]"),
}


def validator(root: Path, name: str) -> Draft202012Validator:
    schema = json.loads((root / "assets" / "schemas" / f"{name}.schema.json").read_text("utf-8"))
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema, format_checker=FormatChecker())


def as_json(toml: str) -> Any:
    """Convert TOML values to JSON: a date and time becomes a string."""
    return json.loads(json.dumps(tomllib.loads(toml), default=lambda moment: moment.isoformat()))


def tables(value: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Paths of all objects in a JSON value."""
    if isinstance(value, dict):
        yield path
    children = value.items() if isinstance(value, dict) else enumerate(value)
    for key, child in children:
        if isinstance(child, dict | list):
            yield from tables(child, (*path, key))


def at(value: Any, path: tuple[str | int, ...]) -> Any:
    for key in path:
        value = value[key]
    return value


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made.make_capture(tmp_path_factory.mktemp("ball"), photos=3)


@pytest.fixture(scope="module")
def measured(ball: Path) -> dict[str, Any]:
    return fitted(ball)


def fitted(capture: Path) -> dict[str, Any]:
    """result.json of a capture, through text and back."""
    job = FitJob(read_capture(capture))
    job.drain()
    assert job.result is not None
    return json.loads(json.dumps(result_json.describe(job.result, job.stages), allow_nan=False))


@pytest.mark.parametrize("name", ["capture", "result", "diagnosis"])
def test_schemas_are_valid_and_closed(root: Path, name: str) -> None:
    """Every object either lists its keys or states the type of all its values."""
    schema = validator(root, name).schema
    assert schema["$schema"].endswith("2020-12/schema")
    for path in tables(schema):
        one = at(schema, path)
        if one.get("type") == "object" and path[-1:] != ("properties",):
            assert "additionalProperties" in one and one.get("description"), path


def test_demo_and_synthetic_captures_are_valid(root: Path, ball: Path) -> None:
    check = validator(root, "capture")
    for file in (root / "assets" / "demo" / "demo.capture.toml", ball):
        check.validate(as_json(file.read_text("utf-8")))
    check.validate(as_json(EVERY_KEY))


def test_capture_schema_has_keys_of_reader(
    root: Path, ball: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reader's list of known keys, recorded when a table is closed."""
    known: dict[tuple[str, ...], set[str]] = defaultdict(set)
    close = Section.close

    def recorded(section: Section) -> None:
        known[tuple(key for key in section.path if isinstance(key, str))] |= section.known
        close(section)

    monkeypatch.setattr(Section, "close", recorded)
    file = ball.with_name("every.capture.toml")
    file.write_text(EVERY_KEY, "utf-8")
    read_capture(file)
    assert {path: sorted(keys) for path, keys in known.items()} == {
        path: sorted(keys) for path, keys in properties(validator(root, "capture").schema)
    }


def properties(
    schema: dict[str, Any], path: tuple[str, ...] = (), top: dict[str, Any] | None = None
) -> Iterator[tuple[tuple[str, ...], set[str]]]:
    """(path, property names) of every table that a schema describes."""
    top = top or schema
    if "$ref" in schema:
        schema = top["$defs"][schema["$ref"].removeprefix("#/$defs/")]
    if "items" in schema:
        yield from properties(schema["items"], path, top)
    if "properties" in schema:
        yield path, set(schema["properties"])
        for key, child in schema["properties"].items():
            yield from properties(child, (*path, key), top)


def test_unknown_key_is_rejected_in_every_table(root: Path) -> None:
    check = validator(root, "capture")
    whole = as_json(EVERY_KEY)
    places = [path for path in tables(whole) if path[-1:] != ("masks",)]
    assert len(places) > 15
    for path in places:
        wrong = copy.deepcopy(whole)
        at(wrong, path)["smaples"] = 3
        assert not check.is_valid(wrong), path


@pytest.mark.parametrize("mistake", MISTAKES)
def test_reader_and_schema_reject_the_same(root: Path, ball: Path, mistake: str) -> None:
    old, new = MISTAKES[mistake]
    text = EVERY_KEY.replace(old, new)
    assert text != EVERY_KEY
    assert not validator(root, "capture").is_valid(as_json(text))
    file = ball.with_name("wrong.capture.toml")
    file.write_text(text, "utf-8")
    with pytest.raises(InputError):
        read_capture(file)


def test_result_is_valid(root: Path, measured: dict[str, Any]) -> None:
    validator(root, "result").validate(measured)


@pytest.mark.usefixtures("simple_portable")
def test_result_of_paper_method_is_valid(root: Path, tmp_path: Path) -> None:
    extra = '[fit]\nmethod = "paper"\ntrials = 2'
    written = fitted(made.make_capture(tmp_path / "ball", photos=3, extra=extra))
    validator(root, "result").validate(written)
    assert written["materials"][0]["chosen"]


WRONG: dict[str, Callable[[dict[str, Any]], Any]] = {
    "wrong key": lambda r: r.update(material=[]),
    "wrong key of a material": lambda r: r["materials"][0].update(coefficents=[]),
    "wrong key of a light": lambda r: r["lights"][0].update(colour=1),
    "two rows of coefficients": lambda r: r["materials"][0]["coefficients"].pop(),
    "a text for an error": lambda r: r["materials"][0]["held_out"].update(error="small"),
    "a missing key": lambda r: r["materials"][0].pop("normal_deviation"),
    "another format": lambda r: r.update(format=1),
}


@pytest.mark.parametrize("mistake", WRONG)
def test_invalid_result_is_rejected(root: Path, measured: dict[str, Any], mistake: str) -> None:
    wrong = copy.deepcopy(measured)
    WRONG[mistake](wrong)
    assert not validator(root, "result").is_valid(wrong)


TESTED_CAUSES = {"light_intensity", "camera_response", "vignetting"}


@pytest.mark.slow
@pytest.mark.usefixtures("simple_portable")
def test_diagnosis_is_valid(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a capture in which one lamp was 30 % brighter than stated; three causes are tested."""
    tried = tuple(kind for kind in effects.EFFECTS if kind.cause in TESTED_CAUSES)
    monkeypatch.setattr(effects, "EFFECTS", tried)
    capture = made.make_capture(tmp_path / "ball", photos=4)
    poses, lights = list(made.poses(4)), list(made.light_directions(4))
    brighter = 1.3 * made.photo(*poses[1], lights[1])
    made.write_exr(capture.parent / "lit_2.exr", np.asarray(brighter))
    job = CheckJob(FitJob(read_capture(capture)), pixels=3000)
    job.drain()
    found, before, after = job.checked.found, job.checked.result, job.result
    assessment = job.checked.assessment
    assert found is not None and before is not None and after is not None
    assert assessment is not None
    described = json.loads(
        json.dumps(diagnosis_json.describe(found, assessment, before, after), allow_nan=False)
    )
    check = validator(root, "diagnosis")
    check.validate(described)
    assert set(described["tried"]) == TESTED_CAUSES and "light_intensity" in described["named"]
    result = result_json.describe(after, job.stages)
    validator(root, "result").validate(json.loads(json.dumps(result)))
    for wrong_place in (
        described,
        described["causes"][0],
        described["materials"][0],
        described["left"],
    ):
        wrong_place["gian"] = 1.0
        assert not check.is_valid(described)
        del wrong_place["gian"]
    described["named"] = ["bad_luck"]
    assert not check.is_valid(described)
