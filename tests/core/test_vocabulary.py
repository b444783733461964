"""What ships uses the terms of docs/reference/glossary.md: old private words do not come back."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

FOLDERS = ("core", "scene", "operators", "panels", "commands")
# word → the term that is used instead
NAMES = {
    "told": "stated, given", "said": "text, sentence", "asked": "requested",
    "felt": "affected", "unheard": "discarded", "beside": "near, in the background",
    "missed": "residual", "unseen": "held-out", "sights": "ray count", "crew": "thread pool",
    "leftover": "residual structure", "glow": "radiosity", "convincing": "significant",
}  # fmt: skip
CONSTANTS = {
    "MOST", "FEW", "LARGEST", "FEWEST", "SURE", "ALIKE", "MORE", "CASTS", "NEARLY", "WIDER",
    "ALWAYS", "LEAST", "USUAL", "FARTHEST", "ENOUGH", "MANY",
}  # fmt: skip
TEXT = re.compile(
    r"\b(told|felt|doubted|refused|unheard|beside|missed|left-out|unseen|somebody|nobody)\b"
)


def sources(root: Path) -> list[Path]:
    """Every Python file that ships."""
    files = [root / "api.py", root / "headless.py", root / "__init__.py"]
    return files + [path for folder in FOLDERS for path in sorted((root / folder).rglob("*.py"))]


def names(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """(identifier, line) of all that a module defines or uses."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id, node.lineno
        elif isinstance(node, ast.arg):
            yield node.arg, node.lineno
        elif isinstance(node, ast.Attribute):
            yield node.attr, node.lineno
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name, node.lineno


def texts(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """(string, line) of all literals, docstrings included: some are tooltips."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value, node.lineno


@pytest.fixture(scope="module")
def trees(root: Path) -> dict[str, ast.AST]:
    found = {p.relative_to(root).as_posix(): ast.parse(p.read_text("utf-8")) for p in sources(root)}
    assert len(found) > 500
    return found


def test_names_are_standard_terms(trees: dict[str, ast.AST]) -> None:
    found = [
        f"{file}:{line} {name}: {NAMES[word]}"
        for file, tree in trees.items()
        for name, line in names(tree)
        for word in set(name.lower().split("_")) & set(NAMES)
    ]
    assert not found


def test_constants_carry_their_meaning(trees: dict[str, ast.AST]) -> None:
    found = [
        f"{file}:{line} {name}"
        for file, tree in trees.items()
        for name, line in names(tree)
        if name.strip("_") in CONSTANTS
    ]
    assert not found


def test_texts_are_plain_english(trees: dict[str, ast.AST]) -> None:
    found = [
        f"{file}:{line} {match.group()}: {text[:60]!r}"
        for file, tree in trees.items()
        for text, line in texts(tree)
        if (match := TEXT.search(text))
    ]
    assert not found
