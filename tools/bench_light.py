"""Measure errors of light directions, from rendered spheres and photos of chrome spheres."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np


def run(data: Path) -> None:
    """Print the tables of docs/guide/lights.md."""
    _rendered()
    _photos(data / "real/psbox_spheres")


def _rendered() -> None:
    from patina.core.light.sphere import light_from_sphere
    from patina.core.light.sphere_outline import Circle
    from tests import make_spheres as made

    print("## sphere, rendered (degrees off; 20 directions, 70 degrees of view)\n")
    print("| outline | surface | radius, pixels | median | 90 % | largest | above 0.5 |")
    print("|---|---|---|---|---|---|---|")
    spheres, directions, view = made.shown(), made.directions(), made.camera()
    rng = np.random.default_rng(1)
    errors: dict[tuple[str, int], list[float]] = {}
    made.build()
    with tempfile.TemporaryDirectory() as folder:
        for direction in directions:
            pixels = made.picture(direction, Path(folder))
            for index, sphere in enumerate(spheres):
                x, y, radius = sphere.circle
                dx, dy, wider = rng.uniform(-0.05, 0.05, 3)
                rough = Circle((x + dx * radius, y + dy * radius), radius * (1 + wider))
                for name, outline in (("circle, 5 % off", rough), ("mask", made.mask(sphere))):
                    found = light_from_sphere(pixels, view, outline, surface=sphere.surface)
                    errors.setdefault((name, index), []).append(_angle(found.direction, direction))
    for (name, index), values in sorted(errors.items()):
        sphere = spheres[index]
        print(
            f"| {name} | {sphere.surface} | {sphere.circle[2]:.0f} | {np.median(values):.2f} | "
            f"{np.quantile(values, 0.9):.2f} | {max(values):.2f} | "
            f"{sum(v > 0.5 for v in values)} of {len(values)} |",
            flush=True,
        )
    print()


def _photos(folder: Path) -> None:
    if not folder.is_dir():
        print("(found no photos of chrome spheres)\n")
        return
    from tests.core import test_light_sphere_photos as photos

    print("## chrome spheres, photographed (degrees from the published directions)\n")
    print("| sphere, against | " + " | ".join(str(n) for n in range(1, 13)) + " | median |")
    print("|---|" + "---|" * 13)
    for probe in (1, 2):
        found = photos.found_directions(folder / f"LightProbe-{probe}")
        for name in (probe, "merged"):
            off = [_angle(a, b) for a, b in zip(found, photos.published(name), strict=True)]
            row = " | ".join(f"{v:.2f}" for v in off)
            against = "its own" if name == probe else "merged"
            print(f"| {probe}, {against} | {row} | {np.median(off):.2f} |", flush=True)
    print()


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))
