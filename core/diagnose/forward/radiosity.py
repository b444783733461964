"""Radiosity: light that is reflected between the faces of a mesh (Goral, Torrance, Greenberg and
Battaile 1984).

Form factors are estimated with rays drawn by the cosine. The total number of rays is the same for
every mesh. With a million faces the estimate of a single face is coarse, but a pixel averages over
many faces.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import dot, tangents
from ...geometry import RayScene
from ...geometry.lift import SHADOW_LIFT
from ...scan import Mesh

Array = NDArray[np.floating]

RAYS = 1_500_000  # of all faces together
MAX_RAYS_PER_FACE = 24
BOUNCES = 6  # of light, the first one included; the fifth still adds a percent in white folds
OPEN, BEHIND = -1, -2  # of rays that hit nothing, or a face from behind


def visible_faces(rays: RayScene) -> NDArray[np.int32]:
    """(f, r) faces that r rays from each face of the mesh hit from the front, in directions drawn
    by the cosine; OPEN or BEHIND for the others."""
    mesh = rays.mesh
    count = len(mesh.faces)
    real = mesh.face_normals.any(axis=1)  # faces without area have no visible faces
    normal = np.where(real[:, None], mesh.face_normals, (0.0, 0.0, 1.0))
    each = int(np.clip(RAYS // max(count, 1), 1, MAX_RAYS_PER_FACE))
    rng = np.random.default_rng(0)
    start = mesh.vertices[mesh.faces].mean(axis=1) + SHADOW_LIFT * mesh.size * normal
    frame = tangents(normal)
    seen = np.empty((count, each), np.int32)
    for one in range(each):
        sine2 = (one + rng.random(count)) / each
        turn = 2 * np.pi * rng.random(count)
        sine = np.sqrt(sine2)
        towards = np.sqrt(1 - sine2)[:, None] * normal
        for axis, part in zip(frame, (np.cos(turn), np.sin(turn)), strict=True):
            towards = towards + (sine * part)[:, None] * axis
        face = front_faces(mesh, rays.first_hits(start, towards).face, towards)
        seen[:, one] = np.where(real, face, OPEN)
    return seen


def front_faces(mesh: Mesh, face: NDArray[np.integer], towards: Array) -> NDArray[np.integer]:
    """Faces (n,) that rays ``towards`` (n, 3) hit, BEHIND for those hit from behind: through a hole
    in a scan its inside is visible, which is not a surface and emits nothing."""
    hit = np.flatnonzero(face >= 0)
    behind = dot(mesh.face_normals[face[hit]], towards[hit]) > 0
    face = face.copy()
    face[hit[behind]] = BEHIND
    return face


def bounced_radiance(sent: Array, albedo: Array, seen: NDArray[np.int32]) -> NDArray[np.float32]:
    """(f, 3) radiance that diffuse faces emit after all bounces. sent: (f, 3) after the first one,
    of the lamp's light; albedo: (f, 3); seen: (f, r) of ``visible_faces``."""
    total = last = np.asarray(sent, np.float32)
    for _ in range(BOUNCES - 1):
        arriving = np.zeros_like(total)
        for faces in seen.T:
            arriving += np.where((faces >= 0)[:, None], last[faces], 0)
        last = albedo * (arriving / seen.shape[1])
        total = total + last
    return total
