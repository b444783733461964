"""Right click, Online Manual: every button of Patina has a page of the documentation."""

from __future__ import annotations

import re
from fnmatch import fnmatchcase
from pathlib import Path

import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

import bpy  # noqa: E402

from patina.panels import manual  # noqa: E402

SPECIFIC = {"guide/sidebar.html"}  # the page of everything that no other page describes


def page_of(name: str) -> str | None:
    """The page that Blender's search for a name in lower case finds."""
    _, pairs = manual.pages()
    return next((page for pattern, page in pairs if fnmatchcase(name.lower(), pattern)), None)


def idnames(root: Path) -> list[str]:
    """The identifiers of all operators, as in the sources."""
    found = []
    folders = ("operators", "panels", "scene")
    for file in sorted(file for folder in folders for file in (root / folder).rglob("*.py")):
        found += re.findall(r'bl_idname = "patina\.(\w+)"', file.read_text("utf-8"))
    return found


def test_every_operator_has_a_page(root: Path) -> None:
    names = idnames(root)
    assert len(names) > 35
    assert {name for name in names if page_of(f"bpy.ops.patina.{name}") in SPECIFIC} == set()
    patterns = [pattern for pattern, _ in manual.pages()[1] if "ops" in pattern]
    for pattern in patterns[:-1]:
        known = pattern.removeprefix("bpy.ops.patina.").rstrip("*")
        assert any(name.startswith(known) for name in names), pattern


def test_patterns_of_settings_are_classes(root: Path) -> None:
    text = "".join(f.read_text("utf-8") for f in (root / "scene").rglob("*.py"))
    text += "".join(f.read_text("utf-8") for f in (root / "panels").rglob("*.py"))
    classes = {name.lower() for name in re.findall(r"class (Patina\w+)\(", text)}
    patterns = [p for p, _ in manual.pages()[1] if p.startswith("bpy.types.") and p.endswith(".*")]
    assert len(patterns) > 8
    for pattern in patterns:
        assert pattern.removeprefix("bpy.types.").removesuffix(".*") in classes, pattern


def test_settings_have_a_page() -> None:
    assert page_of("bpy.types.PatinaViews.exposure") == "guide/views.html"
    assert page_of("bpy.types.PatinaScene.anything") == "guide/sidebar.html"
    assert page_of("bpy.types.Scene.render") is None


def test_pages_and_their_sections_exist(root: Path) -> None:
    for page in manual.PAGES:
        file, _, section = page.partition("#")
        text = (root / "docs" / file).with_suffix(".md").read_text("utf-8")
        headings = re.findall(r"^#+ (.*)$", text, re.M)
        slugs = {re.sub(r"[^\w\- ]", "", h).strip().lower().replace(" ", "-") for h in headings}
        assert not section or section in slugs, page


def test_blender_finds_the_page_and_forgets_it(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(manual, "FOLDER", tmp_path)
    before = list(bpy.utils.manual_map())
    manual.register()
    lookup = bpy.types.WM_OT_doc_view_manual._lookup_rna_url
    expected = f"{tmp_path.as_uri()}/guide/sidebar.html#during-a-job"
    assert lookup("bpy.ops.patina.fit", verbose=False) == expected
    manual.unregister()
    manual.unregister()
    assert list(bpy.utils.manual_map()) == before


def test_a_checkout_without_the_site_has_no_pages(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(manual, "FOLDER", tmp_path / "missing")
    before = list(bpy.utils.manual_map())
    manual.register()
    assert list(bpy.utils.manual_map()) == before
