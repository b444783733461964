"""Make one capture of the field hunt, diagnose it, and compare the result with the truth."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from patina.core.capture import read_capture
from patina.core.jobs import FitJob
from patina.core.jobs.diagnose_job import DiagnoseJob

from .make import CAPTURE, Truth, make
from .real_sets import make_real

NOT_PHYSICAL = ("outside_basis", "unknown")
"""Names that do not count as false causes where nothing is hidden."""


@dataclass(frozen=True)
class FieldRow:
    """One row of the table. source: name of a real set, or "simulated"; lamp, scan, material,
    encoding, varies: of the capture (make.Truth). strength: RMS change achieved. named: causes
    found, best first. ties: causes that explain the photos as well as the first. error: of held-out
    regions without and with the named causes. seconds: of the diagnosis.

    The names of the fields are the keys of the stored rows."""

    cause: str
    wanted: float
    seed: int
    source: str
    lamp: str
    scan: str
    material: str
    encoding: str
    varies: bool
    strength: float
    named: tuple[str, ...]
    ties: tuple[str, ...]
    error: tuple[float, float]
    seconds: float

    @property
    def hidden(self) -> set[str]:
        """The causes in the capture."""
        return set() if self.cause == "none" else set(self.cause.split("+"))

    @property
    def physical(self) -> tuple[str, ...]:
        """The named causes without NOT_PHYSICAL."""
        return tuple(name for name in self.named if name not in NOT_PHYSICAL)

    @property
    def right_first(self) -> bool:
        """Whether a hidden cause is named first, or nothing physical where nothing is hidden."""
        if not self.hidden:
            return not self.physical
        return bool(self.physical) and self.physical[0] in self.hidden

    @property
    def right_set(self) -> bool:
        """Whether exactly the hidden causes are named."""
        return set(self.physical) == self.hidden


def judged(
    source: str, cause: str, strength: float, seed: int, threads: int | None = None
) -> FieldRow:
    """Make a capture in a temporary folder, diagnose it and return its row. source: "simulated" or
    the name of a real set."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if source == "simulated":
            truth = make(folder, cause, strength, seed)
        else:
            truth = make_real(folder, source, cause, strength, seed)
        fit = FitJob(read_capture(folder / CAPTURE), threads=threads, portable=False)
        job = DiagnoseJob(fit)
        start = time.perf_counter()
        job.drain()
        return _row(source, truth, job, time.perf_counter() - start)


def _row(source: str, truth: Truth, job: DiagnoseJob, seconds: float) -> FieldRow:
    found = job.found
    assert found is not None
    first = found.named[0] if found.named else None
    return FieldRow(
        cause=truth.cause, wanted=truth.wanted, seed=truth.seed, source=source, lamp=truth.lamp,
        scan=truth.scan, material=truth.material, encoding=truth.encoding, varies=truth.varies,
        strength=truth.strength, named=found.causes,
        ties=() if first is None else tuple(effect.cause for effect in first.ties),
        error=(found.error_before.parts, found.error_after.parts), seconds=seconds,
    )  # fmt: skip
