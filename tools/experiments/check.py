"""The first check: our photos against those that another renderer made of the same captures."""

from __future__ import annotations

import json

import numpy as np

from patina.core.photo.photo import read_photo

from . import bunnies, materials
from .runs import Records
from .simulate import sample_scanned


def tasks(quick: bool) -> list[str]:
    """The captures of the reference data, by stereo tool."""
    return ["MVE"] if quick else list(bunnies.BUNNIES)


def work(tool: str) -> Records:
    """Ours against theirs at every trusted pixel of the eight photos."""
    capture, scan, shots = bunnies.opened(tool)
    truth = json.loads((bunnies.folder(tool) / "truth.json").read_text("utf-8"))
    material = materials.materials([truth["material"]])[0]
    table = sample_scanned(bunnies.true_bunny(), scan.mesh, shots).photograph(
        material.evaluate, None
    )
    theirs = np.concatenate(
        [
            read_photo(photo.files[0]).radiance.reshape(-1, 3)[table.pixel[table.photo == i]]
            for i, photo in enumerate(capture.photos)
        ]
    ).astype(float)
    ours = table.radiance.astype(float)
    both = (ours > 1e-3).all(axis=1) & (theirs > 1e-3).all(axis=1)
    ratio = np.log(ours[both] / theirs[both])
    worst = np.sort(np.square(ours - theirs).sum(axis=1))[::-1]
    return [
        {
            "tool": tool,
            "material": material.name,
            "samples": len(table),
            "median": float(np.median(ratio)),
            "scatter": float(1.4826 * np.median(np.abs(ratio - np.median(ratio)))),
            "relative_l2": float(np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)),
            "worst_20": float(worst[:20].sum() / worst.sum()),
        }
    ]
