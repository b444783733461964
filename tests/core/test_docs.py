"""The documentation names what exists: files, functions, keys, causes, pictures, stored rows."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from patina.core.diagnose.effects import EFFECTS

EQUATION_ROW = re.compile(r"^\| [^|]+ \| .+ \| `(core/[\w/]+\.py)` \| ([^|]+) \|$", re.M)
FILE_REFERENCE = re.compile(r"`((?:core|tools|tests|scene|commands|assets|docs)/[\w/.-]+\.\w+)`")
FOLDER = re.compile(r"`((?:core|tools|tests|scene|commands|assets|docs)/[\w/]+)`")
LINK = re.compile(r"\]\((?!\w+:)([^)#]+)(?:#[^)]*)?\)")
CAUSE = re.compile(r"^\| `(\w+)` \|", re.M)
ROOT_PAGES = ("README.md", "CONTRIBUTING.md")


def test_every_equation_is_implemented_where_the_page_says(root: Path) -> None:
    text = (root / "docs" / "method" / "equations.md").read_text("utf-8")
    rows = EQUATION_ROW.findall(text)
    assert len(rows) == 15
    for equation in ("(1)", "(1)–(2)", "(3)", "(4)", "(5)", "(6)–(7)", "(8)", "(9)"):
        assert f"\n| {equation} |" in text
    for file, functions in rows:
        code = (root / file).read_text("utf-8")
        for name in re.findall(r"`(\w+)`", functions):
            assert re.search(rf"^ *def {name}\(", code, re.M), f"{file} has no {name}"


def pages(root: Path) -> list[Path]:
    return sorted(root.glob("docs/**/*.md"))


def test_every_file_named_on_a_page_exists(root: Path) -> None:
    references = {
        (page.relative_to(root).as_posix(), file)
        for page in [*pages(root), *(root / name for name in ROOT_PAGES)]
        for pattern in (FILE_REFERENCE, FOLDER)
        for file in pattern.findall(page.read_text("utf-8"))
    }
    assert len(references) > 60
    assert not [(page, file) for page, file in sorted(references) if not (root / file).exists()]


def test_links_of_the_root_pages_lead_to_files(root: Path) -> None:
    """MkDocs checks the links between the pages of docs, but not these."""
    links = [link for name in ROOT_PAGES for link in LINK.findall((root / name).read_text("utf-8"))]
    assert len(links) > 20
    assert not [link for link in links if not (root / link).exists()]


def test_rooms_and_their_first_files_exist(root: Path) -> None:
    """The tables of CONTRIBUTING.md; "start with" is relative to one of the rooms of the row."""
    wrong, rooms = [], set()
    base = root
    for line in (root / "CONTRIBUTING.md").read_text("utf-8").splitlines():
        if line.startswith("| room"):
            inside = re.match(r"\| room of `([\w/]+)`", line)
            base = root / inside[1] if inside else root
        elif line.startswith("| `"):
            names, _, start = (re.findall(r"`([\w/.]+)`", cell) for cell in line.split("|")[1:4])
            wrong += [name for name in names if not (base / name).exists()]
            wrong += [f for f in start if not any((base / name / f).is_file() for name in names)]
            rooms |= {(base / name).relative_to(root).as_posix() for name in names}
    assert not wrong
    rules = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]
    layered = {
        f"{contract['containers'][0].removeprefix('patina.').replace('.', '/')}/{name}"
        for contract in rules["contracts"]
        if "containers" in contract
        for layer in contract["layers"]
        for name in layer.split(" | ")
    }
    assert {room.removesuffix(".py") for room in rooms} == layered


def test_every_picture_is_shown_on_a_page(root: Path) -> None:
    """Pictures that no page shows are left-overs and should be deleted."""
    text = "".join(p.read_text("utf-8") for p in [*pages(root), root / "README.md"])
    pictures = [p for p in (root / "docs" / "images").rglob("*") if p.is_file()]
    assert len(pictures) > 20
    assert not [picture.name for picture in pictures if f"/{picture.name}" not in text]


def test_glossary_is_in_alphabetical_order(root: Path) -> None:
    text = (root / "docs" / "reference" / "glossary.md").read_text("utf-8")
    terms = re.findall(r"^(\S.*)\n:   ", text, re.M)
    assert len(terms) > 60 and terms == sorted(set(terms), key=str.casefold)


def test_stored_result_rows_can_be_read(root: Path) -> None:
    text = (root / "docs" / "notebook" / "hunt.jsonl").read_text("utf-8")
    rows = [json.loads(line) for line in text.splitlines()]
    keys = {"cause", "wanted", "seed", "named", "gain", "brdf", "seconds", "state"}
    assert len(rows) == 350 and all(keys <= set(row) for row in rows)


def parts(value: Any) -> Iterator[dict[str, Any]]:
    """All objects in a JSON value."""
    if isinstance(value, dict):
        yield value
    for child in value.values() if isinstance(value, dict) else value:
        if isinstance(child, dict | list):
            yield from parts(child)


def schema(root: Path, name: str) -> Any:
    return json.loads((root / "assets" / "schemas" / f"{name}.schema.json").read_text("utf-8"))


def test_every_key_of_the_capture_file_is_documented(root: Path) -> None:
    text = (root / "docs" / "reference" / "capture-file.md").read_text("utf-8")
    keys = {
        key
        for part in parts(schema(root, "capture"))
        if part.get("type") == "object"
        for key, described in part.get("properties", {}).items()
        if described.get("properties") != {}  # a table without keys
    }
    assert len(keys) > 50
    assert not [key for key in sorted(keys) if not re.search(rf"\b{key} *=|\[{key}\]", text)]


def test_every_cause_is_in_the_schema_and_on_its_page(root: Path) -> None:
    causes = {kind.cause for kind in EFFECTS}
    page = (root / "docs" / "method" / "diagnosis.md").read_text("utf-8")
    assert set(CAUSE.findall(page)) == causes
    lists = [
        set(part["enum"]) - {"none", "unknown"}
        for part in parts(schema(root, "diagnosis"))
        if "vignetting" in part.get("enum", ())
    ]
    assert len(lists) == 5 and all(one == lists[0] and causes <= one for one in lists)
