"""Simple implementation of sampling, for comparison: all pixels of a photo at once in float64, the
lens evaluated for every pixel, a local frame for every angle."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation, generate_binary_structure

JUMP = 12.0  # depth difference at an outline, in pixel footprints
LIFT = 5e-4  # offset of shadow rays, fraction of the mesh size


def sample_plainly(rays: Any, camera: Any, light: Any, radiance: np.ndarray, margins: Any) -> Any:
    """Return the SampleTable of one photo with one material and a distant light."""
    from patina.core.geometry.curvature import mean_curvature
    from patina.core.geometry.rays import Hits
    from patina.core.samples import SampleTable

    h, w = camera.height, camera.width
    rows, columns = np.indices((h, w), np.float64)
    directions = camera.rays(np.stack([columns.ravel() + 0.5, rows.ravel() + 0.5], axis=1))
    hits = rays.first_hits(camera.pose.centre, directions)
    pixel = np.flatnonzero(hits.face >= 0)
    met = Hits(hits.face[pixel], hits.u[pixel], hits.v[pixel])
    point, normal, view = rays.points(met), rays.normals(met), -directions[pixel]
    depth = np.full(h * w, np.nan)
    depth[pixel] = np.einsum("ij,ij->i", camera.pose.centre - point, view)
    depth = depth.reshape(h, w)
    in_camera = np.full((h * w, 3), np.nan)
    in_camera[pixel] = (normal @ camera.pose.rotation.T) * (1.0, 1.0, -1.0)
    curvature = mean_curvature(in_camera.reshape(h, w, 3)).ravel()[pixel]

    falls = light.incidence(point, camera)
    towards = np.array(falls.towards)
    cos_i, cos_o = (np.einsum("ij,ij->i", normal, x) for x in (towards, view))
    dark = cos_i <= 0
    up = np.flatnonzero(~dark)
    start = point[up] + LIFT * rays.mesh.size * normal[up]
    dark[up] = rays.occluded(start, np.ascontiguousarray(towards[up]))
    lit, seen = np.zeros((2, h * w), bool)
    lit[pixel], seen[pixel] = ~dark, True
    lit, seen = lit.reshape(h, w), seen.reshape(h, w)
    outline, shade = np.zeros((2, h, w), bool)
    footprint = camera.footprint(depth)
    for one, two in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        jump = (np.abs(depth[one] - depth[two]) > JUMP * footprint[one]) | (seen[one] != seen[two])
        turn = (lit[one] != lit[two]) & seen[one] & seen[two]
        outline[one] |= jump
        outline[two] |= jump
        shade[one] |= turn
        shade[two] |= turn
    near = _widen(outline, margins.silhouette - 1) | _widen(shade, margins.shadow - 1)
    keep = ~dark & (cos_i > margins.cosine) & (cos_o > margins.cosine) & ~near.ravel()[pixel]

    n, to, v = normal[keep], towards[keep], view[keep]
    half = to + v
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    binormal = np.cross(n, half)
    sine = np.linalg.norm(binormal, axis=1)
    binormal /= np.maximum(sine, 1e-9)[:, None]
    tangent = np.cross(binormal, half)
    x, y = np.einsum("ij,ij->i", to, tangent), np.einsum("ij,ij->i", to, binormal)
    light_seen = radiance.reshape(-1, 3)[pixel[keep]]
    irradiance = np.array(falls.irradiance)[keep]
    single = np.float32
    return SampleTable(
        photo=np.zeros(len(n), np.int16),
        pixel=pixel[keep].astype(np.int32),
        theta_h=np.arctan2(sine, np.einsum("ij,ij->i", n, half)).astype(single),
        theta_d=np.arctan2(np.hypot(x, y), np.einsum("ij,ij->i", to, half)).astype(single),
        phi_d=np.mod(np.arctan2(y, x), np.pi).astype(single),
        cos_i=cos_i[keep].astype(single),
        cos_o=cos_o[keep].astype(single),
        rho=(light_seen / (irradiance * cos_i[keep, None])).astype(single),
        radiance=light_seen,
        variance=np.zeros_like(light_seen),
        point=point[keep],
        normal=n.astype(single),
        view=v.astype(single),
        curvature=curvature[keep],
        light=to.astype(single),
        irradiance=irradiance.astype(single),
        weight=np.ones(len(n), single),
        response=np.ones((len(n), 3), np.float32),
    )


def _widen(edge: np.ndarray, pixels: int) -> np.ndarray:
    for step in range(pixels):
        edge = binary_dilation(edge, generate_binary_structure(2, 1 + step % 2))
    return edge
