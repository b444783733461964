"""First check: simulated photos compared with those of another renderer, for the same captures."""

from __future__ import annotations

import json

import numpy as np

from patina.core.photo.photo import read_photo

from . import bunnies, materials
from .runs import Records
from .simulate import sample_scanned


def tasks(quick: bool) -> list[str]:
    """Return the captures of the reference data, by stereo tool."""
    return ["MVE"] if quick else list(bunnies.BUNNIES)


def work(tool: str) -> Records:
    """Compare both renderers at every trusted pixel of the eight photos."""
    capture, scan, shots = bunnies.opened(tool)
    truth = json.loads((bunnies.folder(tool) / "truth.json").read_text("utf-8"))
    material = materials.materials([truth["material"]])[0]
    table = sample_scanned(bunnies.true_bunny(), scan.mesh, shots).photograph(
        material.evaluate, None
    )
    reference = np.concatenate(
        [
            read_photo(photo.files[0]).radiance.reshape(-1, 3)[table.pixel[table.photo == i]]
            for i, photo in enumerate(capture.photos)
        ]
    ).astype(float)
    simulated = table.radiance.astype(float)
    both = (simulated > 1e-3).all(axis=1) & (reference > 1e-3).all(axis=1)
    ratio = np.log(simulated[both] / reference[both])
    worst = np.sort(np.square(simulated - reference).sum(axis=1))[::-1]
    return [
        {
            "tool": tool,
            "material": material.name,
            "samples": len(table),
            "median": float(np.median(ratio)),
            "scatter": float(1.4826 * np.median(np.abs(ratio - np.median(ratio)))),
            "relative_l2": float(np.linalg.norm(simulated - reference) / np.linalg.norm(reference)),
            "worst_20": float(worst[:20].sum() / worst.sum()),
        }
    ]
