"""A closed triangle mesh of the unit sphere."""

from __future__ import annotations

import numpy as np


def sphere(rows: int) -> tuple[np.ndarray, np.ndarray]:
    """(points, faces) of a closed unit sphere with about 4 rows² faces."""
    theta = np.linspace(0, np.pi, rows + 1)[1:-1]
    phi = np.arange(2 * rows) / rows * np.pi
    t, p = np.meshgrid(theta, phi, indexing="ij")
    rings = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    points = np.concatenate([rings, [[0, 0, 1], [0, 0, -1]]])
    faces = []
    columns = 2 * rows
    for ring in range(rows - 2):
        for i in range(columns):
            a, b = ring * columns + i, ring * columns + (i + 1) % columns
            faces += [[a, a + columns, b], [b, a + columns, b + columns]]
    last = (rows - 2) * columns
    for i in range(columns):
        faces.append([len(rings), i, (i + 1) % columns])
        faces.append([last + (i + 1) % columns, last + i, len(rings) + 1])
    return points, np.array(faces)
