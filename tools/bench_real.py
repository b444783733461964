"""Measure errors on held-out photos of real captures.

Errors are computed in the encoding of the photos (0..1, as displayed), so that the assumed tone
curve does not change the scale of the error.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

THIN = 12  # use every 12th trusted pixel, because neighbours are redundant
HELD_OUT = ("9521", "9562", "9599", "9651")  # photos of the bronze, also of the rival's figure
DARK = 0.02  # encoded value below which the relative error is mainly noise


def run(data: Path) -> None:
    """Print both tables."""
    from . import real_captures

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print("\nDiLiGenT ball (orthographic, 24 distant lights), each photo from the others:\n")
        _table([("as published", real_captures.ball(data, folder))])
        print("\nRodin bronze (16 flash photos), each photo from the others:\n")
        cases = []
        for chart in (False, True):
            for refine in (False, True):
                label = f"{'tone by chart' if chart else 'sRGB curve'}, "
                label += "flash refined" if refine else "flash at the lens"
                cases.append((label, real_captures.rodin(data, folder, chart, refine)))
        _table(cases)
        print("\nRodin bronze, 12 photos fitted, 4 predicted (Kintsugi 3D Builder 1.6.0: encoded "
              "RMSE 0.085):\n")  # fmt: skip
        _held_out_photos(cases)


def _held_out_photos(cases: list[tuple[str, Path]]) -> None:
    """Print the errors of the photos HELD_OUT, predicted from a fit of the others."""
    import patina
    from patina.core.predict.errors import PhotoErrors

    print("| capture | typical | relative RMS | encoded RMSE | by photo |")
    print("|---|---|---|---|---|")
    for label, path in cases:
        capture = patina.load_capture(path)
        names = [photo.file.stem for photo in capture.photos]
        held = [k for k, name in enumerate(names) if name.endswith(HELD_OUT)]
        fitted = patina.fit(
            patina.select_photos(capture, [k for k in range(len(names)) if k not in held])
        )
        errors = [found.errors for found in patina.predict(capture, fitted, photos=held)]
        mean = PhotoErrors.mean(errors)
        each = ", ".join(f"{one.encoded_rmse:.3f}" for one in errors)
        print(f"| {label} | {100 * mean.typical:.1f} % | {100 * mean.relative_rms:.1f} % | "
              f"{mean.encoded_rmse:.4f} | {each} |", flush=True)  # fmt: skip


@dataclass(frozen=True)
class _Case:
    """Samples of a capture, tone curve of its photos, and results of the light refinement."""

    table: object
    curve: tuple[np.ndarray, np.ndarray]
    unexplained: tuple[float, float] | None
    moved: dict[str, dict[str, tuple[float, float]]]


def _table(cases: list[tuple[str, Path]]) -> None:
    print("| capture | samples | paper's fit: typical, relative RMS | all samples, 20 components | "
          "one Lambertian |")  # fmt: skip
    print("|---|---|---|---|---|")
    notes = []
    for label, path in cases:
        case = _samples(path)
        errors = [
            _leave_one_out(case, estimator) for estimator in (_paper, _all_samples, _lambertian)
        ]
        cells = " | ".join(f"{100 * typical:.1f} %, {100 * rms:.1f} %" for typical, rms in errors)
        print(f"| {label} | {len(case.table):,} | {cells} |", flush=True)  # type: ignore[arg-type]
        for name, parameters in case.moved.items():
            position = ", ".join(f"{k} {v:.2f} ± {e:.2f}" for k, (v, e) in parameters.items())
            before, after = case.unexplained or (0, 0)
            notes.append(
                f"{label}: {name} at {position}; unexplained log residual {before:.3f} → "
                f"{after:.3f}"
            )
    for note in notes:
        print(f"\n{note}")


def _samples(path: Path) -> _Case:
    from patina.core.basis import default_basis
    from patina.core.capture import read_capture
    from patina.core.concurrency.steps import drained
    from patina.core.geometry import RayScene, view_surface
    from patina.core.inputs import capture_data
    from patina.core.inputs.lights import find_lights, refined
    from patina.core.inputs.photos import LitPhotos
    from patina.core.photo.transfer import Transfer
    from patina.core.samples import SampleTable, sample_photo
    from patina.core.samples.level import at_typical_level
    from patina.core.samples.take import light_surface, trusted_pixels

    capture, basis = read_capture(path), default_basis()
    scan = capture_data.open_scan(capture)
    capture_data.check_photos(capture, scan)
    rays, photos = RayScene.build(scan.mesh), LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    if any(light.refine for light in capture.lights):
        lights = drained(refined(lights, capture, scan, photos, rays, basis))
    tables = []
    for place in range(len(capture.photos)):
        camera = capture_data.camera_of(capture, scan, place)
        view = view_surface(rays, camera)
        lighting = light_surface(rays, view, lights.of(capture, place), camera)
        lit = photos.read(place)
        keep = trusted_pixels(view, lighting, capture.fit.margins)
        keep &= lit.usable.ravel()[view.pixel]
        keep[np.arange(len(keep)) % THIN != place % THIN] = False
        tables.append(sample_photo(view, lighting, lit.radiance, keep))
    table, _ = at_typical_level(SampleTable.join(tables), basis)
    encoded = np.linspace(0, 1, 4097)
    curve = photos.curve(0)
    curve = curve if curve.curves else Transfer.named("srgb")  # as these JPEGs state
    linear = curve.decode(np.repeat(encoded[:, None], 3, axis=1))
    return _Case(table, (encoded, linear), lights.unexplained, lights.moved)


def _leave_one_out(case: _Case, estimator: object) -> tuple[float, float]:
    """Return (typical, RMS) relative errors of encoded values, each photo held out in turn."""
    relative, squared_error, size = [], 0.0, 0.0
    table = case.table
    for photo in np.unique(table.photo):  # type: ignore[attr-defined]
        out = table.photo == photo  # type: ignore[attr-defined]
        held = table.select(out)  # type: ignore[attr-defined]
        rho = estimator(table.select(~out), held)  # type: ignore[attr-defined,operator]
        predicted = _encode(rho * held.irradiance * held.cos_i[:, None], case.curve)
        measured = _encode(held.radiance, case.curve)
        level = measured.mean(axis=1)
        deviation = np.abs(predicted - measured).mean(axis=1)
        relative.append((deviation / level)[level > DARK])
        squared_error += float(np.sum((predicted - measured) ** 2))
        size += float(np.sum(measured**2))
    return float(np.median(np.concatenate(relative))), float(np.sqrt(squared_error / size))


def _encode(radiance: np.ndarray, curve: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    encoded, linear = curve
    return np.stack([np.interp(radiance[:, c], linear[:, c], encoded) for c in range(3)], axis=1)


def _paper(table: object, held: object) -> np.ndarray:
    from patina.core.basis import default_basis
    from patina.core.fit import fit_paper

    return fit_paper(table, default_basis()).brdf.evaluate(held.angles)  # type: ignore[attr-defined,arg-type,no-any-return]


def _all_samples(table: object, held: object) -> np.ndarray:
    """Ridge regression (Nielsen et al. 2015) on all samples, without a selection of pixels."""
    from patina.core.basis import default_basis
    from patina.core.fit import ridge

    basis = default_basis()
    _, q = basis.rows(table.angles, 20)  # type: ignore[attr-defined]
    mapped = basis.mapped(table.rho, table.angles)  # type: ignore[attr-defined]
    return basis.evaluate(ridge.solve(q, mapped), held.angles)  # type: ignore[attr-defined]


def _lambertian(table: object, held: object) -> np.ndarray:
    """A Lambertian BRDF, as a baseline."""
    return np.broadcast_to(np.median(table.rho, axis=0), held.rho.shape)  # type: ignore[attr-defined]
