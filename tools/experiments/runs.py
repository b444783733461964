"""Run the tasks of an experiment in parallel processes; the records keep the order of the tasks."""

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
    """Return the records of all tasks, in the order of the tasks.

    only: estimators to run, None for all. keep: called with all records so far after each task, so
    that an interrupted run loses only the tasks in progress.
    """
    start = time.perf_counter()
    results: dict[int, Records] = {}
    if workers <= 1 or len(tasks) == 1:
        _start(only)
        for place, task in enumerate(tasks):
            results[place] = work(task)
            keep(_in_order(results))
            _report_progress(name, len(results), len(tasks), start)
    else:
        context = get_context("spawn")
        with ProcessPoolExecutor(workers, context, _start, (only,)) as pool:
            waiting = {pool.submit(work, task): place for place, task in enumerate(tasks)}
            for done in as_completed(waiting):
                results[waiting[done]] = done.result()
                keep(_in_order(results))
                _report_progress(name, len(results), len(tasks), start)
    return _in_order(results)


IDENTITY = (
    "sweep", "where", "value", "label", "variant", "kind",
    "scene", "material", "estimator", "in_basis", "seed",
)  # fmt: skip
"""Keys that identify a record, if it has them."""


def merged(old: Records, new: Records, only: Sequence[str] | None, ended: bool) -> Records:
    """Replace old records by new ones.

    While a run has not ended, only records of the same cases are replaced, so that an interrupted
    run loses nothing. Afterwards, all old records are replaced, or (with ``only``) those of the
    estimators that were run.
    """
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

    estimators.select(only)


def _in_order(results: dict[int, Records]) -> Records:
    return [record for place in sorted(results) for record in results[place]]


def _report_progress(name: str, done: int, of: int, start: float) -> None:
    say(f"{name}: {done} of {of} ({time.perf_counter() - start:.0f} s)")
