"""Renderings under other illumination, on their own page and in the report."""

from __future__ import annotations

from pathlib import Path

from patina.core.report.relit import Picture, add_to_report, section, write_page

SPHERE = Picture(Path("sphere_a b_forest.png"), "forest", "a <b>")
TURNS = [Picture(Path(f"turntable_forest/{i:03d}.png"), "forest", "object", i) for i in range(12)]


def test_page_links_files_unchanged_and_escapes_subjects(tmp_path):
    text = write_page(tmp_path, [SPHERE, *TURNS]).read_text("utf-8")
    assert "sphere_a%20b_forest.png" in text and "a &lt;b&gt;" in text and "<b>" not in text
    assert text.endswith("</html>")


def test_turntable_is_shown_with_few_images():
    text = section(TURNS)
    assert 4 <= text.count("<img") <= 8 and "turntable_forest/000.png" in text


def test_report_gets_renderings_once_at_end(tmp_path):
    page = tmp_path / "index.html"
    page.write_text("<h1>x</h1></html>", "utf-8")
    add_to_report(page, [SPHERE], "relit")
    text = page.read_text("utf-8")
    assert text.startswith("<h1>x</h1>") and text.count("</html>") == 1
    assert "relit/sphere_a%20b_forest.png" in text


def test_report_without_renderings_is_unchanged(tmp_path):
    page = tmp_path / "index.html"
    page.write_text("<h1>x</h1></html>", "utf-8")
    add_to_report(page, [], "relit")
    assert page.read_text("utf-8") == "<h1>x</h1></html>"
