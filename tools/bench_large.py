"""Measure time and memory of materials that vary with as many photos as a farm gets.

The capture is made by a script: a painted ball in 100 JPEGs of 24 megapixels.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from .bench_speed import case

CASES = ((16, 3, 100_000), (100, 24, 1_000_000))  # photos, megapixels, triangles


def run(_: Path) -> None:
    """Print times and peak memory."""
    print("| photos | faces | nodes | fit | all | peak memory, fit | all |\n" + "|---" * 7 + "|")
    for photos, megapixels, triangles in CASES:
        with tempfile.TemporaryDirectory() as folder:
            case("make", folder, megapixels, triangles, photos, "painted")
            found = case("varying", folder)
        print(
            f"| {photos} of {megapixels} MP | {triangles:,} | {found['nodes']:,} | "
            f"{found['fit']:.0f} s | {found['all']:.0f} s | {found['fit_mb']:.0f} MB | "
            f"{found['all_mb']:.0f} MB |",
            flush=True,
        )
