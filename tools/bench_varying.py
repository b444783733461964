"""Measure what the variation of materials over the surface gains on real captures.

Held-out photos are predicted without and with it. Errors are in the photos' own encoding, as in
`predict`; of DiLiGenT's linear photos also as relative L1, Σ|p − y| / Σ y, which its published
figures use.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import real_captures
from .bench_real import HELD_OUT
from .experiments.bunnies import BUNNIES

if TYPE_CHECKING:
    from patina.core.capture import Capture
    from patina.core.jobs import CaptureResult
    from patina.core.jobs.photo_prediction import PhotoPrediction
    from patina.core.predict.errors import PhotoErrors

START_ERROR = 2.0  # degrees, median error of the normals of the changed meshes


def run(data: Path) -> None:
    """Print the tables."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print("\nRodin bronze, 12 photos fitted, 4 predicted (Kintsugi 3D Builder 1.6.0: encoded "
              "RMSE 0.085):\n")  # fmt: skip
        _header()
        bronze = real_captures.rodin(data, folder, chart=False, refine=True)
        _held_out("bronze", bronze, [_named(bronze, HELD_OUT)])
        print("\nDiLiGenT, even photos fitted, odd photos predicted:\n")
        _header("relative L1 | normals before | after")
        for label, path, truth in _diligent(data, folder):
            places = range(len(_read(path).photos))
            _held_out(label, path, [[k for k in places if k % 2]], truth)
        print("\nThe three simulated bunnies, each of one even material:\n")
        for label in BUNNIES.values():
            _even(label, data / "scans" / label / "scan.capture.toml")
        print("\nEach photo predicted from all others:\n")
        _header()
        _held_out("bronze", bronze, _each_alone(bronze))
        for label in ("yellow_box", "card_blue"):
            path = real_captures.plane(data, folder, label)
            _held_out(label, path, _each_alone(path), plain=True)


def _even(label: str, path: Path) -> None:
    """Print what a fit says of an even material, and how far it changes it."""
    from patina.core.jobs import FitJob, finished
    from patina.core.jobs.varying.varying_job import VaryingJob

    job = FitJob(_read(path), portable=False)
    since = time.perf_counter()
    job.drain()
    between = time.perf_counter()
    more = VaryingJob(job)
    more.drain()
    before, after = (finished(one.result).materials[0].fit.brdf for one in (job, more))
    change = float(np.abs(before.coefficients - after.coefficients).max())
    print(
        f"{label}: {finished(more.result).notes[-1]} Largest change of a coefficient: {change:g}. "
        f"{between - since:.0f} s, and {time.perf_counter() - between:.0f} s for this.",
        flush=True,
    )


def _diligent(data: Path, folder: Path) -> list[tuple[str, Path, Path]]:
    """(label, capture, folder of the true normals) of the sets, exact and with errors."""
    from .experiments.mesh_error import bumpy

    found = []
    for name in ("ball", "cat", "reading"):
        make: Callable[..., Path] = (
            real_captures.ball if name == "ball" else partial(real_captures.diligent, name=name)
        )
        for label, change in (
            ("", None),
            (", normals 2° off", partial(bumpy, degrees=START_ERROR)),
        ):
            place = folder / f"{name}{len(label)}"
            place.mkdir()
            truth = data / "real" / f"diligent_{name}"
            found.append((name + label, make(data, place, change=change), truth))
    return found


def _header(more: str = "") -> None:
    names = ["capture", "materials", "typical", "relative RMS", "encoded RMSE", "seconds"]
    names += [more] if more else []
    print("| " + " | ".join(names) + " |")
    print("|" + "---|" * " | ".join(names).count("|") + "---|")


def _read(path: Path) -> Capture:
    import patina

    return patina.load_capture(path)


def _named(path: Path, ends: tuple[str, ...]) -> list[int]:
    """The photos whose names end so."""
    return [k for k, p in enumerate(_read(path).photos) if p.file.stem.endswith(ends)]


def _each_alone(path: Path) -> list[list[int]]:
    """Groups of one photo each."""
    return [[k] for k in range(len(_read(path).photos))]


@dataclass(frozen=True)
class _Outcome:
    """Predictions of held-out photos, and the fit they are made from."""

    fitted: CaptureResult
    predictions: list[PhotoPrediction]
    seconds: float


def _held_out(
    label: str,
    path: Path,
    groups: Sequence[Sequence[int]],
    truth: Path | None = None,
    plain: bool = False,
) -> None:
    """Print a row for even materials and one for what held-out photos prefer; with ``plain`` two
    more for a plain way, and for the latter at the same nodes."""
    import patina
    from patina.core.jobs import FitJob, finished
    from patina.core.jobs.varying.varying_job import VaryingJob
    from patina.core.predict.errors import PhotoErrors

    capture = _read(path)
    rows: dict[str, list[_Outcome]] = {"even": [], "varying": []}
    at_nodes: dict[str, list[PhotoErrors]] = {}
    for held in groups:
        kept = [k for k in range(len(capture.photos)) if k not in held]
        job = FitJob(patina.select_photos(capture, kept), portable=False)
        since = time.perf_counter()
        job.drain()
        fitted = finished(job.result)
        rows["even"].append(
            _Outcome(fitted, _predicted(capture, fitted, held), time.perf_counter() - since)
        )
        since = time.perf_counter()
        more = VaryingJob(job)
        more.drain()
        varied = finished(more.result)
        rows["varying"].append(
            _Outcome(varied, _predicted(capture, varied, held), time.perf_counter() - since)
        )
        if plain:
            for way, errors in _errors_at_nodes(capture, varied, kept, held).items():
                at_nodes.setdefault(way, []).extend(errors)
    for kind, outcomes in rows.items():
        errors = PhotoErrors.mean([p.errors for one in outcomes for p in one.predictions])
        cells = [
            label, _kinds(outcomes) if kind == "varying" else "even",
            f"{100 * errors.typical:.1f} %", f"{100 * errors.relative_rms:.1f} %",
            f"{errors.encoded_rmse:.4f}", f"{np.mean([one.seconds for one in outcomes]):.0f}",
        ]  # fmt: skip
        if truth is not None:
            cells += [f"{_relative_l1(outcomes):.4f}", *_normal_errors(outcomes[0], truth)]
        print("| " + " | ".join(cells) + " |", flush=True)
    for way, found in at_nodes.items():
        errors = PhotoErrors.mean(found)
        cells = [label, way, f"{100 * errors.typical:.1f} %", f"{100 * errors.relative_rms:.1f} %",
                 f"{errors.encoded_rmse:.4f}", ""]  # fmt: skip
        print("| " + " | ".join(cells) + " |", flush=True)


def _errors_at_nodes(
    capture: Capture, varied: CaptureResult, kept: Sequence[int], held: Sequence[int]
) -> dict[str, list[PhotoErrors]]:
    """Errors of held-out photos at the nodes that they and fitted photos show: of a Lambertian
    colour at each node with one GGX lobe for all, and of a fit with variation."""
    from patina.core.concurrency.steps import drained
    from patina.core.jobs.photo_prediction import prediction_inputs
    from patina.core.jobs.varying.surface_observations import observe_surface
    from patina.core.photo.encoding import Encoding
    from patina.core.predict.errors import PhotoErrors

    from .bench_objects import NODES, ours
    from .objects.plain import lambert_ggx

    given = prediction_inputs(capture, varied)
    every = replace(varied, capture=capture, photos=given.photos, lights=given.lights)
    surface = drained(observe_surface(every, NODES, 0.0, 1.0))
    seen = surface.seen.select(np.flatnonzero(np.isin(surface.seen.photo, kept)))
    fit = lambert_ggx(seen, surface.grid.normals(np.arange(len(surface.grid))))
    shown = np.bincount(seen.node, minlength=len(surface.grid)) > 0
    ways = ("Lambert and GGX, at nodes", "vary, at nodes")
    found: dict[str, list[PhotoErrors]] = {way: [] for way in ways}
    for place in held:
        own = (surface.seen.photo == place) & shown[surface.seen.node]
        some = surface.seen.select(np.flatnonzero(own))
        encoding = Encoding.of_file(capture.photos[place].file, every.photos.curve(place))
        exposure = np.float32(every.photos.exposures[place][0])
        measured = encoding.encode(some.radiance * exposure)
        radiances = (fit.predict(some), ours("", varied, surface, some, 0.0).predicted)
        for way, radiance in zip(ways, radiances, strict=True):
            encoded = encoding.encode(np.maximum(radiance, 0).astype(np.float32) * exposure)
            found[way].append(PhotoErrors.of(encoded, measured))
    return found


def _predicted(
    capture: Capture, fitted: CaptureResult, places: Sequence[int]
) -> list[PhotoPrediction]:
    from patina.core.concurrency.steps import drained
    from patina.core.jobs.photo_prediction import predict_one, prediction_inputs

    given = prediction_inputs(capture, fitted)
    return [drained(predict_one(given, place)) for place in places]


def _kinds(outcomes: list[_Outcome]) -> str:
    """What was found to vary."""
    found = {
        "even" if one.fitted.varying is None else one.fitted.varying.materials[0].kind
        for one in outcomes
    }
    return " or ".join(sorted(found))


def _relative_l1(outcomes: list[_Outcome]) -> float:
    """Σ|p − y| / Σ y over all pixels."""
    difference = total = 0.0
    for one in outcomes:
        for photo in one.predictions:
            y = photo.measured[photo.compared].astype(np.float64)
            difference += float(np.abs(photo.encoded[photo.compared] - y).sum())
            total += float(y.sum())
    return difference / total


def _normal_errors(outcome: _Outcome, truth: Path) -> list[str]:
    """Mean angles in degrees between true normals and those of the mesh, and of the nodes."""
    from scipy.io import loadmat

    from patina.core.geometry import view_surface
    from patina.core.inputs import capture_data
    from patina.core.varying.node_model import tilted
    from patina.core.varying.varying_surface import barycentric

    fitted = outcome.fitted
    true = loadmat(truth / "Normal_gt.mat")["Normal_gt"].reshape(-1, 3)
    camera = capture_data.camera_of(fitted.capture, fitted.scan, 0)
    view = view_surface(fitted.rays, camera)
    wanted = true[view.pixel]
    known = np.linalg.norm(wanted, axis=1) > 0.5

    def error(normal: NDArray) -> str:
        cosine = np.einsum("ij,ij->i", normal[known], wanted[known])
        return f"{np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean():.2f}°"

    normal = np.asarray(view.normal, np.float32)
    if fitted.varying is None:
        return [error(normal), error(normal)]
    place = barycentric(fitted.scan.mesh, view.face, view.point)
    return [error(normal), error(tilted(normal, fitted.varying.at(view.face, *place)))]
