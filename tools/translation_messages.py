"""The labels and tooltips of the interface, and which of them a language lacks:

    python3 -m tools.translation_messages

They are read from the sources: names and descriptions of properties and operators, items of enums,
labels of panels and texts of layouts. Sentences that are made at run time are not translated.
"""

from __future__ import annotations

import ast
import json
import re
import sys
from collections.abc import Iterator

from .common import ROOT

FOLDERS = ("panels", "operators", "scene")
TRANSLATIONS = ROOT / "assets" / "translations"
WORD = re.compile(r"[A-Za-z]{2}")
TEXTS = {"text", "heading", "placeholder"}  # arguments of layouts
PROPERTY_TEXTS = {"name", "description"}
LISTS = re.compile(
    r"(ITEMS|KINDS|AGAINST|CHANNELS|SCALES|WAYS|FORMATS|HEADINGS)$"
)  # names of lists of enum items


def messages() -> dict[str, str]:
    """Return message → the file that it is in, in the order of the sources."""
    found: dict[str, str] = {}
    for folder in FOLDERS:
        for file in sorted((ROOT / folder).rglob("*.py")):
            for text in _texts(ast.parse(file.read_text("utf-8"))):
                if WORD.search(text):
                    found.setdefault(text.strip(), file.relative_to(ROOT).as_posix())
    return found


def translations() -> dict[str, dict[str, str]]:
    """Return locale → message → translation."""
    return {
        file.stem: json.loads(file.read_text("utf-8"))
        for file in sorted(TRANSLATIONS.glob("*.json"))
    }


def _texts(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield from _of_call(node)
        elif isinstance(node, ast.ClassDef):
            yield from _of_class(node)
        elif isinstance(node, (ast.Assign, ast.AnnAssign)) and node.value is not None:
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            if LISTS.search(getattr(target, "id", "")):
                yield from _of_list(node.value)


def _of_call(node: ast.Call) -> Iterator[str]:
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    for keyword in node.keywords:
        if keyword.arg in TEXTS or (keyword.arg in PROPERTY_TEXTS and name.endswith("Property")):
            yield from _strings(keyword.value)
        elif keyword.arg == "items" and name.endswith("Property"):
            yield from _of_list(keyword.value)


def _of_class(node: ast.ClassDef) -> Iterator[str]:
    own = {
        getattr(part.targets[0], "id", ""): part.value
        for part in node.body
        if isinstance(part, ast.Assign)
    }
    if "bl_label" not in own:
        return
    for name in ("bl_label", "bl_description"):
        if name in own:
            yield from _strings(own[name])
    is_shown = "INTERNAL" not in ast.dump(own.get("bl_options", ast.Constant("")))
    documentation = ast.get_docstring(node)
    if "bl_description" not in own and "bl_idname" in own and is_shown and documentation:
        yield " ".join(documentation.split())


def _of_list(node: ast.expr) -> Iterator[str]:
    """Label and tooltip of each item, (identifier, label, tooltip), or values of a dictionary."""
    if isinstance(node, ast.Dict):
        for value in node.values:
            yield from _strings(value)
    elif isinstance(node, (ast.List, ast.Tuple)):
        for item in node.elts:
            if isinstance(item, ast.Tuple):
                for part in item.elts[1:3]:
                    yield from _strings(part)


def _strings(node: ast.expr) -> Iterator[str]:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, (ast.Tuple, ast.List)):
        for each in node.elts:
            yield from _strings(each)
    elif isinstance(node, ast.IfExp):
        yield from _strings(node.body)
        yield from _strings(node.orelse)


def main() -> int:
    """Print what each language lacks and what it has in excess; return 1 if there is any."""
    known, code = messages(), 0
    for locale, texts in translations().items():
        for message in known.keys() - texts.keys():
            print(f"{locale} lacks {message!r} ({known[message]})")
            code = 1
        for message in texts.keys() - known.keys():
            print(f"{locale} has {message!r}, which is in no source")
            code = 1
    return code


if __name__ == "__main__":
    if "--list" in sys.argv:
        print(json.dumps(list(messages()), ensure_ascii=False, indent=1))
    else:
        sys.exit(main())
