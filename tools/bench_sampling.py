"""Compare sampled reflectance with the truth, with scanned and with exact normals."""

from __future__ import annotations

from pathlib import Path

import numpy as np


def run(data: Path) -> None:
    """Print the table of docs/method/measurements.md, section "Samples"."""
    from patina.commands.compare import truth_weights
    from patina.core.brdf import nbrdf
    from patina.core.capture import read_capture
    from patina.core.geometry import RayScene, view_surface
    from patina.core.inputs.capture_data import camera_of, open_scan
    from patina.core.inputs.lights import find_lights
    from patina.core.inputs.photos import LitPhotos
    from patina.core.samples import Margins, SampleTable, sample_photo
    from patina.core.samples.take import light_surface, trusted_pixels
    from patina.core.scan.mesh import read_mesh

    print("## sampling\n")
    print("ln(measured / true reflectance): median and robust scatter (1.4826 MAD)\n")
    print("| capture | mesh | samples | channels pooled: all | theta_h < 3 degrees | "
          "channel means: all | theta_h < 3 degrees | samples there |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|")
    scans = data / "scans"
    exact = read_mesh(scans / "bunny_truth.ply")
    for name in ("bunny_bronze", "bunny_red", "bunny_fabric"):
        capture = read_capture(scans / name / "scan.capture.toml")
        weights = truth_weights(scans / name / "truth.json")
        scan = open_scan(capture)
        photos = LitPhotos.open(capture)
        lights = find_lights(capture, scan, photos)
        for label, mesh in (("scanned", scan.mesh), ("exact", exact)):
            rays = RayScene.build(mesh)
            tables = []
            for place in range(len(capture.photos)):
                light = lights.of(capture, place)
                camera = camera_of(capture, scan, place)
                view = view_surface(rays, camera)
                lighting = light_surface(rays, view, light, camera)
                keep = trusted_pixels(view, lighting, Margins())
                radiance = photos.read(place).radiance
                tables.append(sample_photo(view, lighting, radiance, keep))
            table = SampleTable.join(tables)
            truth = nbrdf.evaluate(weights, table.angles)
            peak = table.theta_h < np.radians(3)
            pooled = _log(table.rho, truth)
            mean = _log(table.rho.mean(axis=1), truth.mean(axis=1))
            print(
                f"| {name} | {label} | {len(table):,} | {_robust(pooled)} | "
                f"{_robust(pooled[peak])} | {_robust(mean)} | {_robust(mean[peak])} | "
                f"{int(peak.sum()):,} |",
                flush=True,
            )
    print()


def _log(measured: np.ndarray, truth: np.ndarray) -> np.ndarray:
    return np.log(np.maximum(measured, 1e-6) / truth)


def _robust(x: np.ndarray) -> str:
    median = np.median(x)
    return f"{median:+.4f} ± {1.4826 * np.median(np.abs(x - median)):.4f}"
