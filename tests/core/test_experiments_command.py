"""The command's words; what it runs has tests of its own."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tools.experiments import __main__ as command
from tools.experiments import estimators, runs, store


def test_an_unknown_experiment_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["experiments", "figure12"])
    with pytest.raises(SystemExit) as end:
        command.main()
    assert end.value.code == 2
    assert "'figure12'" in capsys.readouterr().err


def test_without_the_reference_data_it_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr("sys.argv", ["experiments", "check"])
    monkeypatch.setenv("PATINA_SHARED", str(tmp_path))
    assert command.main() == 2
    assert "found no reference data" in capsys.readouterr().err


def test_results_are_kept_apart_from_quick_ones(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATINA_CACHE", str(tmp_path))
    store.save("goals", [{"a": 1}], quick=True)
    assert store.load("goals") is None
    assert store.load("goals", quick=True) == [{"a": 1}]
    assert json.loads(store.path("goals", True).read_text("utf-8")) == [{"a": 1}]


def test_records_come_in_the_order_of_the_tasks() -> None:
    kept: list[int] = []
    found = runs.run_all(
        "x", lambda n: [{"n": n}, {"n": -n}], [3, 1, 2], 1, keep=lambda r: kept.append(len(r))
    )
    assert kept == [2, 4, 6]
    assert [r["n"] for r in found] == [3, -3, 1, -1, 2, -2]


def test_only_the_estimators_asked_for_are_run() -> None:
    try:
        estimators.select(["paper"])
        assert list(estimators.rows()) == ["paper"]
        assert estimators.is_selected("paper") and not estimators.is_selected("ours")
    finally:
        estimators.select(None)
    assert "all samples k=20" in estimators.rows()
