"""Run the objects of a collection on a Dask cluster: one process for each object.

The scheduler only distributes the work. What is finished is known from the folders of the results
(record.py), so that a lost worker or scheduler costs no result.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import PatinaError
from . import remote
from .collection import Item
from .record import finished, record_file

CONNECT_SECONDS = 60.0  # that a scheduler may take to answer
LOST_SECONDS = 600.0  # after which a scheduler that was lost is given up
RETRY_INTERVAL = 2.0  # seconds between two attempts to reach it
MAX_QUEUED = 1000  # objects given to the scheduler at a time: its memory does not grow with all
SETTINGS = {  # of Dask here: its processes look at themselves a hundred times a second otherwise
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.admin.system-monitor.gil.enabled": False,
    "distributed.scheduler.work-stealing": False,
    "distributed.scheduler.active-memory-manager.start": False,
}
NEEDED = (
    "a batch needs the package dask.distributed; install the Python package patina with its extra "
    "'farm'"
)


@dataclass(frozen=True)
class Limits:
    """Of the process of one object. gigabytes, seconds: 0 for none; attempts: after as many failed
    ones it counts as failed."""

    gigabytes: float = 0.0
    seconds: float = 0.0
    attempts: int = 3


@dataclass(frozen=True)
class Work:
    """What to run for an object. words: the process; inputs: hash of what its result depends on."""

    item: Item
    words: tuple[str, ...]
    inputs: str


@dataclass(frozen=True)
class Outcome:
    """What came of an object. error: "" where it succeeded."""

    item: Item
    seconds: float
    peak_mb: float
    attempts: int
    error: str


def run_on_cluster(
    work: Sequence[Work],
    out: Path,
    environment: dict[str, str],
    limits: Limits,
    address: str | None = None,
    workers: int = 1,
    waiting: Callable[[], object] = lambda: None,
) -> Iterator[Outcome]:
    """Run all, and yield what came of each as it ends. out: folder of the results; environment: of
    the processes; address: of an existing scheduler; None: ``workers`` processes here. waiting: is
    called when an object has ended or a second has passed. Raises PatinaError."""
    try:
        from distributed import Client
    except ImportError as error:
        raise PatinaError(NEEDED) from error
    left = {one.item.name: one for one in work}
    attempts = dict.fromkeys(left, 1)
    lost_at: float | None = None
    with nullcontext(address) if address else _local_cluster(workers) as cluster:
        while left:
            try:
                with _connected(Client, cluster) as client:
                    lost_at = None
                    for outcome in _submitted(
                        client, left, attempts, out, environment, limits, waiting
                    ):
                        del left[outcome.item.name]
                        yield outcome
            except _lost_errors() as error:
                for one in list(left.values()):  # what ended meanwhile
                    known = finished(out, one.item.name, one.inputs)
                    if known is not None:
                        del left[one.item.name]
                        yield Outcome(one.item, **vars(known), error="")
                lost_at = lost_at or time.monotonic()
                if time.monotonic() - lost_at > LOST_SECONDS:
                    raise PatinaError(
                        f"the scheduler {address or ''} cannot be reached; {len(left)} objects are "
                        "left; run the command again to continue"
                    ) from error
                waiting()
                time.sleep(RETRY_INTERVAL)


@contextmanager
def _local_cluster(workers: int) -> Iterator[Any]:
    """A scheduler and workers on this computer."""
    import dask
    from distributed import LocalCluster

    with (
        dask.config.set(SETTINGS),
        LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, memory_limit=None,
            dashboard_address=None,
        ) as cluster,
    ):  # fmt: skip
        yield cluster


class _SentByValue:
    """The function run_process, for workers that have no Patina."""

    def __init__(self) -> None:
        import cloudpickle

        cloudpickle.register_pickle_by_value(remote)
        self._load, self._content = cloudpickle.loads, cloudpickle.dumps(remote.run_process)
        cloudpickle.unregister_pickle_by_value(remote)

    def __call__(self, *arguments: Any) -> dict[str, Any]:
        return remote.run_process(*arguments)

    def __reduce__(self) -> tuple[Any, tuple[bytes]]:
        return self._load, (self._content,)


@contextmanager
def _connected(client: Any, cluster: Any) -> Iterator[Any]:
    made = client(cluster, timeout=CONNECT_SECONDS, set_as_default=False)
    try:
        yield made
    finally:
        made.close(timeout=CONNECT_SECONDS)


def _lost_errors() -> tuple[type[BaseException], ...]:
    """What Dask raises where the connection to the scheduler is lost."""
    from concurrent.futures import CancelledError

    from distributed.client import FutureCancelledError
    from distributed.comm.core import CommClosedError

    return OSError, TimeoutError, CommClosedError, CancelledError, FutureCancelledError


def _submitted(
    client: Any,
    left: dict[str, Work],
    attempts: dict[str, int],
    out: Path,
    environment: dict[str, str],
    limits: Limits,
    waiting: Callable[[], object],
) -> Iterator[Outcome]:
    """Give the objects to the scheduler, a part at a time, and yield what came of each."""
    from distributed import as_completed

    run_process = _SentByValue()
    queue = iter(list(left.values()))

    def submit(one: Work) -> Any:
        name = one.item.name
        return client.submit(
            run_process, list(one.words), environment, str(out / name),
            str(record_file(out, name)), one.inputs, attempts[name], limits.gigabytes,
            limits.seconds, key=f"{name}-{attempts[name]}-{time.monotonic_ns()}", pure=False,
            retries=0,  # only after a lost worker, which Dask does on its own
        )  # fmt: skip

    of_future = {}
    running = as_completed(loop=client.loop, raise_errors=False)
    for one in queue:
        future = submit(one)
        of_future[future.key] = one
        running.add(future)
        if len(of_future) >= MAX_QUEUED:
            break
    while of_future:
        for future in _ended(running, waiting):
            one = of_future.pop(future.key)
            name = one.item.name
            error, found = _result(future)
            if error and attempts[name] < limits.attempts:
                attempts[name] += 1
                again = submit(one)
                of_future[again.key] = one
                running.add(again)
                continue
            yield Outcome(
                one.item,
                found.get("seconds", 0.0),
                found.get("peak_mb", 0.0),
                attempts[name],
                error,
            )
            following = next(queue, None)
            if following is not None:
                future = submit(following)
                of_future[future.key] = following
                running.add(future)


def _ended(running: Any, waiting: Callable[[], object]) -> list[Any]:
    """The futures that have ended, after at most a second."""
    waiting()
    if not running.has_ready():
        time.sleep(0.05)
    return list(running.next_batch(block=False)) if running.has_ready() else []


def _result(future: Any) -> tuple[str, dict[str, Any]]:
    """(error, what is known) of a future that has ended. Raises the errors of a lost scheduler."""
    if future.status == "cancelled":
        raise TimeoutError("the scheduler was lost")
    if future.status == "error":
        return str(future.exception()) or "the worker was lost", {}
    found = future.result()
    return str(found["message"]), found
