"""Lamps near the object told from distant ones in simulated photos, and photos grouped by lamp."""

from __future__ import annotations

import numpy as np

from .find_light_simulated import (
    LAMPS,
    MATERIALS,
    PHOTOS_OF_LAMP,
    SCANS,
    SEED,
    degrees_between,
    simulated_pictures,
)

DISTANCES = (None, 4.0, 2.0)  # of the lamps, in extents (diagonals) of the object; None: distant
CAPTURES = 12
PIXELS = 3000  # of a photo, as in new_capture


def near_or_distant() -> None:
    """Print a row for each distance of the lamps."""
    print("## near lamps and distant lamps, four lamps with two photos each, no group known\n")
    print(
        "| lamps | captures | called near | lamps found | pairs of photos grouped rightly | "
        "largest direction error |"
    )
    print("|---|---|---|---|---|---|")
    for distance in DISTANCES:
        rows = [_row(count, distance) for count in range(CAPTURES)]
        near = [row for row in rows if row is not None]
        name = "distant" if distance is None else f"{distance:g} extents away"
        lamps = sorted({row[0] for row in near})
        right = np.mean([row[1] for row in near]) if near else float("nan")
        off = max((row[2] for row in near), default=float("nan"))
        print(
            f"| {name} | {len(rows)} | {len(near)} | {lamps or '–'} | "
            f"{100 * right:.0f} % | {off:.1f}° |",
            flush=True,
        )
    print()


def _row(count: int, distance: float | None) -> tuple[int, float, float] | None:
    """(lamps found, share of pairs of photos that are grouped correctly, largest error of a lamp in
    degrees), None where the lamps are called distant."""
    from patina.core.basis import default_basis
    from patina.core.concurrency.steps import drained
    from patina.core.geometry import RayScene
    from patina.core.light import DistantLight, NearLight
    from patina.core.light_search import UnknownLamp, draw_lamp_pixels, find_lamps
    from patina.core.light_search.brdf_dictionary import BrdfDictionary
    from patina.core.new_capture.near_lamps import near_lamps
    from patina.core.new_capture.opened_scan import OpenedScan
    from patina.core.scan import Scan

    from .experiments import mesh_error, scenes, shapes
    from .experiments.materials import materials
    from .experiments.simulate import Shot

    shape, kind, degrees = SCANS[count // 4]
    true = shapes.true_shape(shape)
    mesh = mesh_error.make(kind)(true, degrees, 0)
    shots = scenes.rig(SEED + count, LAMPS * PHOTOS_OF_LAMP, scenes.ANGLES)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    centre, extent = 0.5 * (low + high), float(np.linalg.norm(high - low))
    towards = [shot.light.direction for shot in shots[:LAMPS]]
    lamps = [shot.light for shot in shots[:LAMPS]]
    if distance is not None:
        lamps = [
            NearLight(f"lamp {i}", centre + distance * extent * d, np.full(3, 10.0))
            for i, d in enumerate(towards)
        ]
    shots = tuple(Shot(s.camera, lamps[i % LAMPS]) for i, s in enumerate(shots))
    material = materials([MATERIALS[count % len(MATERIALS)]])[0]
    pictures = simulated_pictures(true, shots, material.evaluate, SEED + count)
    rays, rng = RayScene.build(mesh), np.random.default_rng(0)
    parts = [
        draw_lamp_pixels(
            rays, shot.camera, picture, np.zeros(picture.shape[:2], np.int16), PIXELS, rng
        )
        for shot, picture in zip(shots, pictures, strict=True)
    ]
    dictionary = BrdfDictionary.of(default_basis())
    opened = OpenedScan(Scan(mesh, tuple(shot.camera for shot in shots)), rays, dictionary)
    start = DistantLight("lamp", np.array([0.0, 0.0, 1.0]))
    unknown = [UnknownLamp(start, (part,)) for part in parts]
    distant = drained(find_lamps(unknown, 1, rays, dictionary, with_errors=False)).lamps
    found = drained(near_lamps(parts, [d for d in distant if d], None, centre, opened))
    if found is None:
        return None
    groups, true_groups = np.array(found.groups), np.arange(len(shots)) % LAMPS
    pairs = np.triu_indices(len(shots), 1)
    right = (groups[:, None] == groups) == (true_groups[:, None] == true_groups)
    errors = [
        degrees_between((found.positions[k] - centre) / np.linalg.norm(found.positions[k] - centre),
                        towards[true_groups[i]])
        for i, k in enumerate(groups)
    ]  # fmt: skip
    return len(found.positions), float(right[pairs].mean()), max(errors)
