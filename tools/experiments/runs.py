"""Tasks of an experiment on all cores, one process each, and what came out in their order."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import Any

from ..common import say
from ..package import load_patina

Records = list[dict[str, Any]]


def run_all(
    name: str,
    work: Callable[[Any], Records],
    tasks: Sequence[Any],
    workers: int,
    only: Sequence[str] | None = None,
    keep: Callable[[Records], None] = lambda records: None,
) -> Records:
    """The records of all tasks, in the tasks' order whatever their order of ending; only: the
    estimators to run. keep is given all records so far after each task: a run that is broken off
    has lost no more than one."""
    since = time.perf_counter()
    results: dict[int, Records] = {}
    if workers <= 1 or len(tasks) == 1:
        _start(only)
        for place, task in enumerate(tasks):
            results[place] = work(task)
            keep(_in_order(results))
            _tell(name, len(results), len(tasks), since)
    else:
        context = get_context("spawn")
        with ProcessPoolExecutor(workers, context, _start, (only,)) as pool:
            waiting = {pool.submit(work, task): place for place, task in enumerate(tasks)}
            for done in as_completed(waiting):
                results[waiting[done]] = done.result()
                keep(_in_order(results))
                _tell(name, len(results), len(tasks), since)
    return _in_order(results)


IDENTITY = (
    "sweep", "where", "value", "label", "variant", "kind",
    "scene", "material", "estimator", "in_basis", "seed",
)  # fmt: skip
"""What tells one record from another, where it has it."""


def merged(old: Records, new: Records, only: Sequence[str] | None, ended: bool) -> Records:
    """New records in place of the old: until a run has ended, in place of the same cases alone (one
    that is broken off loses nothing); then of all, or of the estimators that were run."""
    if not ended:
        made = {_identity(record) for record in new}
        return [record for record in old if _identity(record) not in made] + new
    if only is None:
        return new
    names = {record.get("estimator") for record in new}
    return [record for record in old if record.get("estimator") not in names] + new


def _identity(record: dict[str, Any]) -> tuple[Any, ...]:
    return tuple(str(record.get(key)) for key in IDENTITY)


def _start(only: Sequence[str] | None) -> None:
    load_patina()
    from . import estimators

    estimators.restrict(only)


def _in_order(results: dict[int, Records]) -> Records:
    return [record for place in sorted(results) for record in results[place]]


def _tell(name: str, done: int, of: int, since: float) -> None:
    say(f"{name}: {done} of {of} ({time.perf_counter() - since:.0f} s)")
