"""Tables and the marked sections of the document, from hand-written records."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from tools.experiments import document, goal_table, records, runs, tables


def record(estimator: str, material: str, log_rms: float, **more: object) -> records.Record:
    figures_ = {"cube_root": log_rms, "relative_l2": log_rms, "specular_l2": log_rms}
    return {
        "estimator": estimator, "material": material, "scene": "bunny-openmvs", "seed": 0,
        "in_basis": False, "log_rms": log_rms, "peak": 1.0, "peaks": [1.0, 1.0, 1.0],
        **figures_, **more,
    }  # fmt: skip


def rows_of(table: str) -> dict[str, list[str]]:
    cells = [[c.strip() for c in line.split("|")[1:-1]] for line in table.splitlines()]
    return {row[0]: row[1:] for row in cells[2:]}


def test_goals_are_medians_of_ratios_per_material() -> None:
    found = [
        *(record("paper", "pink-fabric", x, seed=i) for i, x in enumerate((0.2, 0.4, 0.9))),
        record("ours", "pink-fabric", 0.1, peak=1.1),
        record("paper", "alum-bronze", 0.3),
        record("ours", "alum-bronze", 0.09),
        record("paper", "bluebook", 0.5, psnr=[20.0, 30.0, 25.0]),
        record("ours", "bluebook", 0.6, psnr=[41.0, 39.0, 45.0]),
        record("ours", "bluebook", 9.0, in_basis=True),
    ]
    rows = rows_of(goal_table.goals(found))
    # ratios to the paper's median: 0.25, 0.3 and 1.2; their median is 0.3, one material is worse
    assert rows["log-relative RMS (≤ 80°), ours ÷ paper"][1:3] == ["0.30", "yes"]
    worse_row = rows["worse than the paper in no material (both measures)"]
    assert "1.2" in worse_row[1] and "bluebook" in worse_row[1] and worse_row[2] == "**no**"
    picture = next(v for k, v in rows.items() if k.startswith("PSNR"))
    assert picture[1].startswith("41.0 dB") and "25.0 dB" in picture[1] and picture[2] == "yes"
    peak_row = next(v for k, v in rows.items() if k.startswith("flat"))
    assert peak_row[1].startswith("1.10") and peak_row[2] == "yes"


def test_goal_of_a_missing_estimator_is_not_measured() -> None:
    rows = rows_of(goal_table.goals([record("paper", "alum-bronze", 0.3)]))
    assert rows["log-relative RMS (≤ 80°), ours ÷ paper"][1:3] == [goal_table.NOT_MEASURED, ""]


def test_held_out_error_is_compared_with_the_true_image_error() -> None:
    extra = {
        "held_out_rms": 0.12,
        "image_rms": 0.1,
        "held_out_typical": 0.03,
        "image_typical": 0.02,
    }
    rows = rows_of(goal_table.goals([record("ours", "alum-bronze", 0.1, **extra)]))
    reported_row = next(v for k, v in rows.items() if k.startswith("reported"))
    assert (
        "typical 1.50" in reported_row[1]
        and "rms 1.20" in reported_row[1]
        and reported_row[2] == "**no**"
    )


def test_rank_correlation_of_known_orders() -> None:
    def run(errors: list[float]) -> records.Record:
        return {
            "material": "alum-bronze",
            "scene": "s",
            "candidates": [
                {"similarity": i / 10, "log_rms": e, "relative_l2": e} for i, e in enumerate(errors)
            ],
        }

    found = tables.similarity([run([5.0, 4.0, 3.0, 2.0, 1.0])])
    # error of the most similar candidate 1, median 3
    assert "-1.00 ± 0.00" in found and "| 0.33 |" in found
    assert "+1.00" in tables.similarity([run([1.0, 2.0, 3.0, 4.0, 5.0])])


def test_run_of_some_estimators_replaces_only_their_records() -> None:
    old = [record("paper", "a", 1.0), record("ours", "a", 2.0)]
    new = [record("ours", "a", 0.5)]
    merged_records = runs.merged(old, new, ["ours"], ended=True)
    assert [(r["estimator"], r["log_rms"]) for r in merged_records] == [
        ("paper", 1.0),
        ("ours", 0.5),
    ]
    assert runs.merged(old, new, None, ended=True) == new


def test_interrupted_run_keeps_the_records_of_the_last_run() -> None:
    old = [record("ours", "a", 2.0), record("ours", "b", 3.0)]
    merged_records = runs.merged(old, [record("ours", "a", 0.5)], None, ended=False)
    assert [(r["material"], r["log_rms"]) for r in merged_records] == [("b", 3.0), ("a", 0.5)]


def test_only_the_marked_section_is_replaced() -> None:
    text = "a\n<!-- begin x -->\nold\n<!-- end x -->\nb <!-- begin y -->1<!-- end y -->"
    found = document.replaced(text, "x", "new \\1\n")
    assert found == text.replace("old", "new \\1")
    with pytest.raises(ValueError, match="'z'"):
        document.replaced(text, "z", "")


@pytest.mark.parametrize(
    ("file", "markers"),
    [
        (document.DOCUMENT, document.sections()),
        (document.APPEARANCE, document.appearance_sections()),
    ],
    ids=["experiments", "appearance"],
)
def test_document_has_every_marked_section_and_picture(
    file: Path, markers: dict[str, object]
) -> None:
    text = file.read_text("utf-8")
    for marker in markers:
        assert f"<!-- begin {marker} -->" in text and f"<!-- end {marker} -->" in text
    for line in text.splitlines():
        if line.startswith("!["):
            picture = file.parent / line[line.index("](") + 2 : -1]
            assert picture.is_file()
            if picture.suffix == ".svg":
                ElementTree.parse(picture)


def test_sweep_table_shows_medians_in_order() -> None:
    found = [
        {"sweep": "photos", "where": "knot", "value": v, "label": f"{v:g}", "material": m,
         "estimator": "paper", "log_rms": 1 / v + d, "specular_l2": 0.5}
        for v in (16, 2, 8) for m, d in (("a", 0.0), ("b", 0.1), ("c", 0.3))
    ]  # fmt: skip
    table = tables.sweep(found, "photos").splitlines()
    assert [c.strip() for c in table[0].split("|")[3:6]] == ["2", "8", "16"]
    assert "0.600, 0.500" in table[2]
