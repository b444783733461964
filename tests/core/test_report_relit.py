"""Pictures under other light, on a page of their own and in the report."""

from __future__ import annotations

from pathlib import Path

from patina.core.report.relit import Picture, add_to_report, section, write_page

SPHERE = Picture(Path("sphere_a b_forest.png"), "forest", "a <b>")
TURNS = [Picture(Path(f"turntable_forest/{i:03d}.png"), "forest", "object", i) for i in range(12)]


def test_the_page_names_files_as_they_are_and_subjects_escaped(tmp_path):
    text = write_page(tmp_path, [SPHERE, *TURNS]).read_text("utf-8")
    assert "sphere_a%20b_forest.png" in text and "a &lt;b&gt;" in text and "<b>" not in text
    assert text.endswith("</html>")


def test_a_turn_is_shown_in_few_pictures():
    text = section(TURNS)
    assert 4 <= text.count("<img") <= 8 and "turntable_forest/000.png" in text


def test_the_report_gets_them_once_at_its_end(tmp_path):
    page = tmp_path / "index.html"
    page.write_text("<h1>x</h1></html>", "utf-8")
    add_to_report(page, [SPHERE], "relit")
    text = page.read_text("utf-8")
    assert text.startswith("<h1>x</h1>") and text.count("</html>") == 1
    assert "relit/sphere_a%20b_forest.png" in text


def test_without_pictures_a_report_stays_as_it_is(tmp_path):
    page = tmp_path / "index.html"
    page.write_text("<h1>x</h1></html>", "utf-8")
    add_to_report(page, [], "relit")
    assert page.read_text("utf-8") == "<h1>x</h1></html>"
