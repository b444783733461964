"""Files, functions and pictures that the documentation names exist; stored results can be read."""

from __future__ import annotations

import json
import re
from pathlib import Path

EQUATION_ROW = re.compile(r"^\| [^|]+ \| .+ \| `(core/[\w/]+\.py)` \| ([^|]+) \|$", re.M)
FILE_REFERENCE = re.compile(r"`((?:core|tools|tests|scene|commands|assets|docs)/[\w/.-]+\.\w+)`")


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
        for page in pages(root)
        for file in FILE_REFERENCE.findall(page.read_text("utf-8"))
    }
    assert len(references) > 20
    assert not [(page, file) for page, file in sorted(references) if not (root / file).exists()]


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
