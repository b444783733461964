"""What `run.py hunt` judges by, and which captures it makes."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

from tests.make_lit_ball import lit_ball  # noqa: E402
from tools.hunt import judged, table  # noqa: E402
from tools.hunt.judged import Row  # noqa: E402

ROW = Row("area_light", 0.01, 1, 0.01, ("area_light",), (), 5.0, 1.1, 0.3, (0.2,), (1.0, 1.0))


def test_a_near_lamp_is_as_far_as_the_diagnosis_counts():
    """From the middle of what the photos show, not from the origin."""
    context = replace(lit_ball(0), centre=np.array([0.1, -0.2, 0.3]))
    light = 1
    towards = context.pixels.light[context.pixels.photo == 2][0]
    lamp = 2.5 * towards.astype(float)
    found = judged._nearness(1 / 2.5, light, context)
    assert found == pytest.approx(context.size / np.linalg.norm(lamp - context.centre))


def test_what_is_there_is_not_made_again(tmp_path, monkeypatch):
    made = []

    def instead(cause, strength, seed, threads):
        made.append((cause, strength, seed))
        return replace(ROW, cause=cause, wanted=strength, seed=seed)

    monkeypatch.setattr(judged, "judged", instead)
    rows = tmp_path / "rows.jsonl"
    rows.write_text(json.dumps(asdict(ROW)) + "\n", "utf-8")
    words = ["area_light", "--seeds", "1", "2", "--strengths", "0.01", "0.03"]
    monkeypatch.setattr(sys, "argv", ["hunt", *words, "--rows", str(rows)])
    assert table.main() == 0
    first = [("area_light", 0.03, 1)]
    assert made == [*first, ("area_light", 0.01, 2), ("area_light", 0.03, 2)]
    assert len(table.read_rows(rows)) == 4
    assert table.main() == 0
    assert len(made) == 3


def test_a_table_says_what_was_right():
    rows = [ROW, replace(ROW, seed=2, named=("near_light",)), replace(ROW, seed=3, named=())]
    said = table.table(rows)
    assert "| right cause first, at 1 % | 1 of 3 | 1 |" in said
    assert "**near_light**" in said and "**none**" in said
    assert "| parameters within their 95 % interval | 3 of 3 | |" in said
    assert "| rows computed by the current code" in said and "| 0 of 3 | |" in said
