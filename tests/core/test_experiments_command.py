"""The command line of the experiments; the experiments themselves are tested elsewhere."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tools.experiments import __main__ as command
from tools.experiments import estimators, runs, store


def test_error_names_an_unknown_experiment(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["experiments", "figure12"])
    with pytest.raises(SystemExit) as exit_info:
        command.main()
    assert exit_info.value.code == 2
    assert "'figure12'" in capsys.readouterr().err


def test_missing_reference_data_is_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr("sys.argv", ["experiments", "check"])
    monkeypatch.setenv("PATINA_SHARED", str(tmp_path))
    assert command.main() == 2
    assert "found no reference data" in capsys.readouterr().err


def test_quick_results_are_stored_separately(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATINA_CACHE", str(tmp_path))
    store.save("goals", [{"a": 1}], quick=True)
    assert store.load("goals") is None
    assert store.load("goals", quick=True) == [{"a": 1}]
    assert json.loads(store.path("goals", True).read_text("utf-8")) == [{"a": 1}]


def test_records_keep_the_order_of_the_tasks() -> None:
    saved_counts: list[int] = []
    found = runs.run_all(
        "x",
        lambda n: [{"n": n}, {"n": -n}],
        [3, 1, 2],
        1,
        keep=lambda r: saved_counts.append(len(r)),
    )
    assert saved_counts == [2, 4, 6]
    assert [r["n"] for r in found] == [3, -3, 1, -1, 2, -2]


def test_only_the_selected_estimators_run() -> None:
    try:
        estimators.select(["paper"])
        assert list(estimators.rows()) == ["paper"]
        assert estimators.is_selected("paper") and not estimators.is_selected("ours")
    finally:
        estimators.select(None)
    assert "all samples k=20" in estimators.rows()
