"""A simulated object of paint, two metals and dirt: Patina and two plain ways to predict photos.

Cycles renders the exact surface (tools/objects); every method gets the same observations at nodes
of a mesh by a stereo tool, and predicts photos that were held out at the same nodes.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from patina.core.capture import Capture
    from patina.core.jobs import CaptureResult
    from patina.core.jobs.varying.surface_observations import SurfaceObservations
    from patina.core.varying.observations import Observations
    from patina.core.varying.varying_surface import VaryingSurface

    from .objects.finish import Finish

Array = NDArray[np.floating]

FITTED = (8, 24, 96)  # photos
HELD_OUT = 8  # further photos
NODES = 60_000  # of the comparison
WHITE = 99.0  # percentile of the radiance that encodes as 1
KINDS = ("paint", "copper", "steel", "dirt")
MIN_PHOTOS = 2  # that show a node whose colour is judged


@dataclass(frozen=True)
class Row:
    """Errors of one method. predicted: (m, 3); albedo: (n, 3) diffuse colour of the nodes."""

    name: str
    predicted: Array
    albedo: Array
    seconds: float


def run(_: Path) -> None:
    """Print the tables."""
    from .objects.photograph import photograph

    with tempfile.TemporaryDirectory() as name:
        path = photograph(Path(name), max(FITTED) + HELD_OUT)
        for count in FITTED:
            compare(path, count)


def compare(path: Path, count: int) -> None:
    """Print the table of fits to ``count`` photos, which predict the HELD_OUT first ones."""
    import patina
    from patina.core.concurrency.steps import drained
    from patina.core.jobs import FitJob, finished
    from patina.core.jobs.varying.surface_observations import observe_surface
    from patina.core.jobs.varying.varying_job import VaryingJob

    from .objects import plain

    capture = patina.load_capture(path)
    fitted = patina.select_photos(capture, list(range(HELD_OUT, HELD_OUT + count)))
    since = time.perf_counter()
    job = FitJob(fitted, portable=False)
    job.drain()
    even_seconds = time.perf_counter() - since
    even = finished(job.result)
    more = VaryingJob(job)
    more.drain()
    seconds = time.perf_counter() - since
    varied = finished(more.result)
    surface = drained(observe_surface(_of_all(even, capture), NODES, 0.0, 1.0))
    known = surface.seen.photo >= HELD_OUT
    known &= surface.seen.photo < HELD_OUT + count
    seen = surface.seen.select(np.flatnonzero(known)).measured()
    held = surface.seen.select(np.flatnonzero(surface.seen.photo < HELD_OUT)).measured()
    normals = surface.grid.normals(np.arange(len(surface.grid)))
    rows = [ours("even", even, surface, held, even_seconds)]
    ways = {"Lambert and GGX": plain.lambert_ggx, "basis weights": plain.basis_weights}
    for name, fit in ways.items():
        since = time.perf_counter()
        found = fit(seen, normals)
        predicted = found.predict(held)
        rows.append(Row(name, predicted, found.albedo, time.perf_counter() - since))
    rows.append(ours("Patina, varying", varied, surface, held, seconds))
    print(f"\n{count} photos, {HELD_OUT} others predicted. {varied.notes[-1]}\n")
    truth = _truth(surface)
    _print(rows, truth, seen, held)
    if varied.varying is not None:
        _print_intervals(varied.varying, surface, truth, rows[-1])


def _of_all(fitted: CaptureResult, capture: Capture) -> CaptureResult:
    """The fit, with all photos of a capture to be read."""
    from patina.core.inputs.lights import find_lights
    from patina.core.inputs.photos import LitPhotos

    photos = LitPhotos.open(capture)
    lights = find_lights(capture, fitted.scan, photos)
    return replace(fitted, capture=capture, photos=photos, lights=lights)


def _parameters(fitted: CaptureResult, surface: SurfaceObservations) -> Array:
    from patina.core.varying.node_model import COUNT

    if fitted.varying is None:
        return np.zeros((len(surface.grid), COUNT), np.float32)
    return fitted.varying.at(*surface.grid.places)


def ours(
    name: str,
    fitted: CaptureResult,
    surface: SurfaceObservations,
    held: Observations,
    seconds: float,
) -> Row:
    """The row of a fit. surface: all nodes; held: the observations to predict."""
    from patina.core.varying.node_model import DIFFUSE, NodeModel

    theta = _parameters(fitted, surface)
    normals = surface.grid.normals(np.arange(len(surface.grid))).astype(np.float32)
    predicted, albedo = np.zeros((len(held), 3)), np.zeros((len(normals), 3))
    material_of = fitted.face_material[surface.grid.places[0]]
    for index, material in enumerate(fitted.materials):
        model = NodeModel.of(material.fit.brdf, material.scale)
        own = np.flatnonzero(material_of == index)
        diffuse = np.pi * np.minimum(model.body, 1.0) / model.scale
        albedo[own] = diffuse * np.exp(theta[own][:, DIFFUSE])
        own = np.flatnonzero(material_of[held.node] == index)
        some = held.select(own)
        predicted[own] = model.radiance(some.shading, normals[some.node], theta[some.node])
    return Row(name, predicted, albedo, seconds)


def _print(rows: list[Row], truth: Finish, seen: Observations, held: Observations) -> None:
    """The table of held-out errors, over all pixels and by material, and of the colours."""
    from patina.core.photo.transfer import srgb_encoded

    white = float(np.percentile(held.radiance, WHITE))
    measured = np.maximum(held.radiance, 0)
    black = 0.03 * float(np.median(measured))
    shown = np.bincount(seen.node, minlength=len(truth.kind))
    known = shown[held.node] > 0
    judged = (shown >= MIN_PHOTOS) & (truth.metallic < 0.05)
    print("| method | typical | relative RMS | encoded RMSE | " + " | ".join(KINDS)
          + " | diffuse colour | seconds |")  # fmt: skip
    print("|---|---|---|---|" + "---|" * len(KINDS) + "---|---|")
    for row in rows:
        error = np.abs(row.predicted - measured)
        relative = (error / np.maximum(measured, black)).mean(axis=1)
        rms = np.sqrt(np.square(error[known]).mean() / np.square(measured[known]).mean())
        encoded = srgb_encoded(np.clip(row.predicted / white, 0, 1))
        encoded = np.square(encoded - srgb_encoded(np.clip(measured / white, 0, 1)))
        cells = [row.name, f"{100 * np.median(relative[known]):.1f} %", f"{100 * rms:.1f} %",
                 f"{np.sqrt(encoded[known].mean()):.4f}"]  # fmt: skip
        for kind in range(len(KINDS)):
            own = known & (truth.kind[held.node] == kind)
            cells.append(f"{100 * np.median(relative[own]):.1f} %")
        cells += [f"{100 * colour_error(row.albedo, truth.colour, judged):.1f} %"]
        print("| " + " | ".join(cells) + f" | {row.seconds:.0f} |", flush=True)


def colour_error(found: Array, true: Array, judged: NDArray[np.bool_]) -> float:
    """Median relative error of colours (n, 3), up to one factor a channel."""
    ratio = np.log(np.maximum(found[judged], 1e-4) / true[judged])
    return float(np.median(np.abs(np.expm1(ratio - np.median(ratio, axis=0)))))


def _print_intervals(
    varying: VaryingSurface, surface: SurfaceObservations, truth: Finish, row: Row
) -> None:
    """The share of colours that the 90 % intervals contain."""
    from patina.core.varying.node_model import DIFFUSE

    deviation = replace(varying, parameters=varying.deviation).at(*surface.grid.places)
    judged = (varying.photos[varying.grid.at(*surface.grid.places)[0][:, 0]] >= MIN_PHOTOS) & (
        truth.metallic < 0.05
    )
    error = np.log(np.maximum(row.albedo[judged], 1e-4) / truth.colour[judged])
    error -= np.median(error, axis=0)
    inside = np.abs(error) < 1.645 * deviation[judged][:, DIFFUSE]
    print(f"\n90 % intervals of the diffuse colour contain {100 * inside.mean():.0f} % of it.")


def _truth(surface: SurfaceObservations) -> Finish:
    """The finish at the point of the true mesh nearest to each node."""
    from scipy.spatial import cKDTree

    from .experiments.bunnies import true_bunny
    from .objects.finish import Finish, finish_of

    true = true_bunny().vertices
    finish = finish_of(true)
    points = surface.grid.points(np.arange(len(surface.grid)))
    near = cKDTree(true).query(points)[1]
    return Finish(
        finish.colour[near], finish.metallic[near], finish.roughness[near], finish.kind[near]
    )
