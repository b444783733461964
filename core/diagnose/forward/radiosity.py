"""What the faces of a mesh see of one another: light that goes to and fro between them.

Radiosity (Goral, Torrance, Greenberg and Battaile 1984), its form factors summed by rays that are
drawn by the cosine: as many a face as keep their number the same for every mesh. A coarse sum for
each of a million faces is a fine one over all of them that a pixel sees.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import dot, tangents
from ...geometry import RayScene
from ...geometry.lift import SHADOW_LIFT
from ...scan import Mesh

Array = NDArray[np.floating]

RAYS = 1_500_000  # of all faces
MOST = 24  # of a face
BOUNCES = 6  # of light, the first one included; white folds still give a percent at the fifth
OPEN, BEHIND = -1, -2  # what a ray meets that meets no face from before


def visible_faces(rays: RayScene) -> NDArray[np.int32]:
    """(f, each) faces that each face of the mesh sees in directions drawn by their cosine, from
    before; negative for the open and for what is seen from behind."""
    mesh = rays.mesh
    count = len(mesh.faces)
    real = mesh.face_normals.any(axis=1)  # faces without area see nothing
    normal = np.where(real[:, None], mesh.face_normals, (0.0, 0.0, 1.0))
    each = int(np.clip(RAYS // max(count, 1), 1, MOST))
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
    """Faces (n,) that rays ``towards`` (n, 3) hit, BEHIND for those hit from behind: where a scan
    has a hole, what is seen through it is its inside, which is no surface and sends off nothing."""
    hit = np.flatnonzero(face >= 0)
    behind = dot(mesh.face_normals[face[hit]], towards[hit]) > 0
    face = face.copy()
    face[hit[behind]] = BEHIND
    return face


def bounced_radiance(sent: Array, albedo: Array, seen: NDArray[np.int32]) -> NDArray[np.float32]:
    """(f, 3) radiance that matte faces send off after all bounces. sent: after the first one, of
    the lamp's light; albedo: (f, 3); seen: of ``faces_seen``."""
    total = last = np.asarray(sent, np.float32)
    for _ in range(BOUNCES - 1):
        arriving = np.zeros_like(total)
        for faces in seen.T:
            arriving += np.where((faces >= 0)[:, None], last[faces], 0)
        last = albedo * (arriving / seen.shape[1])
        total = total + last
    return total
