"""Make one capture of the hunt, diagnose it, and compare the result with the hidden effect."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from patina.core.basis import PrincipalBRDF, default_basis, mapping
from patina.core.capture import read_capture
from patina.core.diagnose.forward.diagnosis_context import DiagnosisContext
from patina.core.diagnose.selection.diagnosis import Trial
from patina.core.diagnose.selection.trial import HALF_WIDTH_95
from patina.core.fit.spread import directions
from patina.core.jobs import CaptureResult, FitJob
from patina.core.jobs.check_job import CheckJob

from ..experiments.materials import Material
from .make import CAPTURE, OUTSIDERS, Truth, make, make_plain
from .state import state

OWN_BRDF = ("second_material", "subsurface", "anisotropy", "outside_basis", "interreflection")
"""Causes that change the material, so that the BRDF drawn from the seed is not the truth."""


@dataclass(frozen=True)
class Row:
    """One row of the table. cause, wanted, seed: effect, requested RMS change and seed of the
    capture; strength: RMS change achieved. named: causes found, best first; ties: causes that
    explain the photos as well as the first. gain: of the first cause, in standard errors. brdf:
    BRDF error of the second fit, divided by that of a fit to photos without the effect; None if the
    effect changes the material. brdf_before: the same of the first fit; None also in rows older
    than this field. over_floor: error of held-out regions after the second fit, divided by the
    noise floor. off: errors of the parameters with a known true value, in standard errors. seconds:
    time of rendering and of the diagnosis. state: version of the code (state.py), "" in rows older
    than this field.

    The names of the fields are the keys of the stored rows."""

    cause: str
    wanted: float
    seed: int
    strength: float
    named: tuple[str, ...]
    ties: tuple[str, ...]
    gain: float
    brdf: float | None
    over_floor: float
    off: tuple[float, ...]
    seconds: tuple[float, float]
    state: str = ""
    brdf_before: float | None = None

    @property
    def hidden(self) -> set[str]:
        """The causes in the capture."""
        if self.cause == "none":
            return set()
        return {"unknown"} if self.cause in OUTSIDERS else set(self.cause.split("+"))

    @property
    def inside(self) -> int:
        """Number of parameters in ``off`` whose 95 % interval contains the true value."""
        return sum(abs(each) < HALF_WIDTH_95 for each in self.off)

    @property
    def right(self) -> bool:
        """Whether the diagnosis is right: the hidden cause is named first; no cause for none; both
        causes and no third for a pair; ``unknown``, with or without others, for other effects."""
        if len(self.hidden) != 1:
            return set(self.named) == self.hidden
        if self.hidden == {"unknown"}:
            return "unknown" in self.named
        return self.named[:1] == tuple(self.hidden)

    @property
    def wrong_name(self) -> bool:
        """Whether another cause is named first, and no hidden cause is declared as its tie."""
        first = set(self.named[:1]) - {"unknown"}
        return not self.right and bool(first - self.hidden) and not self.hidden & set(self.ties)


def judged(cause: str, strength: float, seed: int, threads: int | None = None) -> Row:
    """Make a capture in a temporary folder, diagnose it and return its row."""
    version = state()
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        truth = make(Path(folder), cause, strength, seed)
        made = time.perf_counter()
        fit = FitJob(read_capture(Path(folder) / CAPTURE), threads=threads, portable=False)
        job = CheckJob(fit)
        job.drain()
        done = time.perf_counter()
        found, before, after = job.checked.found, job.checked.result, job.result
        assert found is not None and job.checked.context is not None
        assert before is not None and after is not None
        first = found.named[0] if found.named else None
        trials = {trial.effect.cause: trial for trial in found.named}
        off = [
            each
            for name in cause.split("+")
            if name in trials
            for each in parameter_errors(trials[name], truth.parameters, job.checked.context)
        ]
    error = error_before = None
    if not set(cause.split("+")) & set(OWN_BRDF):
        plain = _plain_error(seed, threads)
        true = _true_brdf(truth)
        error, error_before = (brdf_error(fit, true) / plain for fit in (after, before))
    return Row(
        cause=cause,
        wanted=strength,
        seed=seed,
        strength=truth.strength,
        named=found.causes,
        ties=() if first is None else tuple(e.cause for e in first.ties),
        gain=0.0 if first is None else first.ratio,
        brdf=error,
        over_floor=found.error_after.over_floor,
        off=tuple(off),
        seconds=(made - start, done - made),
        state=version,
        brdf_before=error_before,
    )


@lru_cache(maxsize=1)
def _plain_error(seed: int, threads: int | None) -> float:
    """Return the BRDF error of a fit to photos without an effect."""
    with tempfile.TemporaryDirectory() as folder:
        truth = make_plain(Path(folder), seed)
        job = FitJob(read_capture(Path(folder) / CAPTURE), threads=threads, portable=False)
        job.drain()
    assert job.result is not None
    return brdf_error(job.result, _true_brdf(truth))


def _true_brdf(truth: Truth) -> PrincipalBRDF:
    """Return the BRDF that the photos were rendered with."""
    basis = default_basis()
    assert basis.training is not None
    return PrincipalBRDF(basis, basis.training[3 * truth.material : 3 * truth.material + 3])


def brdf_error(result: CaptureResult, true: PrincipalBRDF | Material) -> float:
    """Return the RMS difference of ln(ρ·cosMap + ε) between the first material and its true BRDF,
    over all directions."""
    angles = directions(default_basis().grid)
    weight = mapping.cos_map(angles)
    ours, truth = (
        mapping.log_weighted(brdf.evaluate(angles), weight)
        for brdf in (result.materials[0].fit.brdf, true)
    )
    return float(np.sqrt(np.mean((ours - truth) ** 2)))


def _nearness(inverse: float, light: int, context: DiagnosisContext) -> float:
    """Return the object's size divided by the distance of its centre from a lamp, which is in the
    direction that the capture states, at a distance 1 / inverse from the origin."""
    towards = context.pixels.light[context.light[context.pixels.photo] == light][0]
    return float(context.size / np.linalg.norm(towards / inverse - context.centre))


def parameter_errors(
    trial: Trial, truth: Mapping[str, float], context: DiagnosisContext
) -> list[float]:
    """Return the errors of the parameters with a known true value, in standard errors."""
    x, deviation = trial.identified, trial.standard_errors
    cause = trial.effect.cause
    if cause == "light_intensity":
        wanted = np.array([truth[f"photo {k + 1}"] for k in range(len(x))])
        wanted -= wanted.mean()
    elif cause == "near_light":
        x, deviation = x[::4], deviation[::4]
        wanted = np.array([_nearness(truth["1 / distance"], k, context) for k in range(len(x))])
    elif cause == "light_direction":
        moved, spread = x.reshape(-1, 2), deviation.reshape(-1, 2)
        x = np.hypot(*moved.T)
        deviation = np.hypot(*(moved * spread).T) / np.maximum(x, 1e-9)
        wanted = np.full(len(x), np.tan(truth["angle"]))
    elif cause == "camera_pose":
        shifts = [k for k, name in enumerate(trial.effect.parameters.names) if name in truth]
        x, deviation = x[shifts], deviation[shifts]
        wanted = np.array([truth[trial.effect.parameters.names[k]] for k in shifts])
    elif cause == "ambient_light":
        wanted = np.full(3, truth["radiance"] * np.pi / context.level)
    elif cause == "cast_shadow":
        wanted = np.full(len(x), -truth["darkness"])
    elif cause == "area_light":
        wanted = np.array([truth["angular diameter"]])
    elif cause == "veiling_glare":
        x, deviation, wanted = x[:1], deviation[:1], np.array([truth["part"]])
    else:
        return []
    return [round(float(e), 2) for e in (x - wanted) / np.maximum(deviation, 1e-12)]
