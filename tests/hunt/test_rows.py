"""The evaluation of `run.py hunt`, and which captures it renders."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

from patina.core.diagnose.effects import EFFECTS  # noqa: E402
from tests.make_lit_ball import lit_ball  # noqa: E402
from tools.field_hunt.make import MAKERS as FIELD_MAKERS  # noqa: E402
from tools.hunt import judged, table  # noqa: E402
from tools.hunt.judged import Row  # noqa: E402
from tools.hunt.make import MAKERS  # noqa: E402
from tools.hunt.scene import find_size  # noqa: E402

ROW = Row("area_light", 0.01, 1, 0.01, ("area_light",), (), 5.0, 1.1, 0.3, (0.2,), (1.0, 1.0))


def test_every_cause_can_be_hidden_in_photos():
    """In captures with exact meshes, or in those of scans as they are: only these have a flash."""
    field = {cause for makers in FIELD_MAKERS.values() for cause in makers}
    assert set(MAKERS) <= {kind.cause for kind in EFFECTS}
    assert set(MAKERS) | field == {kind.cause for kind in EFFECTS}


def test_nearness_of_a_light_is_defined_as_in_the_diagnosis():
    """Nearness is measured from the centre of the visible surface, not from the origin."""
    context = replace(lit_ball(0), centre=np.array([0.1, -0.2, 0.3]))
    light = 1
    towards = context.pixels.light[context.pixels.photo == 2][0]
    lamp = 2.5 * towards.astype(float)
    found = judged._nearness(1 / 2.5, light, context)
    assert found == pytest.approx(context.size / np.linalg.norm(lamp - context.centre))


def test_stored_rows_are_not_computed_again(tmp_path, monkeypatch):
    requested = []

    def fake_judged(cause, strength, seed, threads):
        requested.append((cause, strength, seed))
        return replace(ROW, cause=cause, wanted=strength, seed=seed)

    monkeypatch.setattr(judged, "judged", fake_judged)
    rows = tmp_path / "rows.jsonl"
    rows.write_text(json.dumps(asdict(ROW)) + "\n", "utf-8")
    arguments = ["area_light", "--seeds", "1", "2", "--strengths", "0.01", "0.03"]
    monkeypatch.setattr(sys, "argv", ["hunt", *arguments, "--rows", str(rows)])
    assert table.main() == 0
    remaining_first_seed = [("area_light", 0.03, 1)]
    assert requested == [*remaining_first_seed, ("area_light", 0.01, 2), ("area_light", 0.03, 2)]
    assert len(table.read_rows(rows)) == 4
    assert table.main() == 0
    assert len(requested) == 3


def test_table_counts_correct_causes():
    rows = [ROW, replace(ROW, seed=2, named=("near_light",)), replace(ROW, seed=3, named=())]
    text = table.table(rows)
    assert "| right cause first, at 1 % | 1 of 3 | 1 |" in text
    assert "**near_light**" in text and "**none**" in text
    assert "| parameters within their 95 % interval | 3 of 3 | |" in text
    assert "| rows computed by the current code" in text and "| 0 of 3 | |" in text


@pytest.mark.parametrize("wanted", [0.03, 0.1, 0.15])
def test_size_of_an_effect_that_sets_in_suddenly_is_found(wanted):
    """A painted shadow changes nothing until it reaches the object."""

    def change(size: float) -> float:
        return 0.2 / (1 + np.exp(-25 * (size - 1.3)))

    assert change(find_size(change, 0.3, wanted)) == pytest.approx(wanted, rel=0.1)
