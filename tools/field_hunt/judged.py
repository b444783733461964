"""Make one capture of the field hunt, diagnose it, and compare the result with the truth."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from patina.core.capture import read_capture
from patina.core.concurrency.job import finished
from patina.core.diagnose.selection.trial import HALF_WIDTH_95
from patina.core.jobs import FitJob
from patina.core.jobs.check_job import CheckJob
from patina.core.jobs.diagnose_job import DiagnoseJob

from ..experiments.materials import materials
from ..hunt.judged import brdf_error
from .make import CAPTURE, Truth, make
from .parameter_errors import parameter_errors
from .real_sets import make_real

NOT_PHYSICAL = ("outside_basis", "unknown")
"""Names that do not count as false causes where nothing is hidden."""


@dataclass(frozen=True)
class FieldRow:
    """One row of the table. source: name of a real set, or "simulated"; lamp, scan, material,
    encoding, varies: of the capture (make.Truth). strength: RMS change achieved. named: causes
    found, best first. ties: causes that explain the photos as well as the first. error: of held-out
    regions without and with the named causes. seconds: of the diagnosis. gain: of the first cause
    in nats a pixel and channel, and ratio, the same in standard errors. off: errors of the
    parameters with a known true value, in standard errors. brdf, brdf_before: BRDF error of the fit
    with and without the named causes, divided by that of a fit to photos without the effect; None
    for real photographs and a second material. Rows older than these fields have their defaults.

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
    gain: float = 0.0
    ratio: float = 0.0
    off: tuple[float, ...] = ()
    brdf: float | None = None
    brdf_before: float | None = None

    @property
    def inside(self) -> int:
        """Number of parameters in ``off`` whose 95 % interval contains the true value."""
        return sum(abs(each) < HALF_WIDTH_95 for each in self.off)

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
    """Make a capture in a temporary folder, diagnose it, fit again with the named causes, and
    return its row. source: "simulated" or the name of a real set."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if source == "simulated":
            truth = make(folder, cause, strength, seed)
        else:
            truth = make_real(folder, source, cause, strength, seed)
        fit = FitJob(read_capture(folder / CAPTURE), threads=threads, portable=False)
        job = CheckJob(fit)
        start, seconds = time.perf_counter(), None
        while job.step():
            if seconds is None and job.checked.found is not None:
                seconds = time.perf_counter() - start
        assert seconds is not None
        row = _row(truth, job.checked, source, seconds)
        if source != "simulated" or cause in ("none", "second_material"):
            return row
        true, plain = materials([truth.material])[0], _plain_error(seed, threads)
        before, after = (
            brdf_error(finished(result), true) / plain
            for result in (job.checked.result, job.result)
        )
        return replace(row, brdf=after, brdf_before=before)


@lru_cache(maxsize=1)
def _plain_error(seed: int, threads: int | None) -> float:
    """Return the BRDF error of a fit to photos without an effect."""
    with tempfile.TemporaryDirectory() as folder:
        truth = make(Path(folder), "none", 0.0, seed)
        job = FitJob(read_capture(Path(folder) / CAPTURE), threads=threads, portable=False)
        job.drain()
        return brdf_error(finished(job.result), materials([truth.material])[0])


def _row(truth: Truth, job: DiagnoseJob, source: str, seconds: float) -> FieldRow:
    found, context = finished(job.found), finished(job.context)
    first = found.named[0] if found.named else None
    hidden = () if truth.cause == "none" or source != "simulated" else truth.cause.split("+")
    off = [
        each
        for trial in found.named
        if trial.effect.cause in hidden
        for each in parameter_errors(trial, truth, context)
    ]
    return FieldRow(
        cause=truth.cause, wanted=truth.wanted, seed=truth.seed, source=source, lamp=truth.lamp,
        scan=truth.scan, material=truth.material, encoding=truth.encoding, varies=truth.varies,
        strength=truth.strength, named=found.causes,
        ties=() if first is None else tuple(effect.cause for effect in first.ties),
        error=(found.error_before.parts, found.error_after.parts), seconds=seconds,
        gain=0.0 if first is None else first.density, ratio=0.0 if first is None else first.ratio,
        off=tuple(off),
    )  # fmt: skip
