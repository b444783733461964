"""Pixels of a ball in six photos, as input of a diagnosis, with known truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.diagnose.forward.diagnosis_context import DiagnosisContext
from patina.core.diagnose.forward.material_brdfs import MaterialBRDFs
from patina.core.diagnose.forward.pixels import Pixels
from patina.core.diagnose.forward.rig import Rig
from patina.core.diagnose.forward.shading_state import ShadingState
from patina.core.geometry import RayScene
from patina.core.scan import Mesh

PHOTOS, EACH, SIZE = 6, 900, 0.8
NOISE = 0.01


SHARP, GLOSSY = 10, 21  # training materials: half-width of the highlight below 1°, and 2.2°


def lit_ball(seed: int = 0, material: int = SHARP) -> DiagnosisContext:
    """Pixels of a ball in six photos under three lights, of a material of the basis, with noise;
    the radiance is computed here as ρ E cos θi."""
    rng = np.random.default_rng(seed)
    basis = default_basis()
    brdf = PrincipalBRDF(basis, basis.training[3 * material : 3 * material + 3])
    parts = []
    for photo in range(PHOTOS):
        turn = 2 * np.pi * photo / PHOTOS
        eye = np.array([np.cos(turn), np.sin(turn), 0.3]) / np.hypot(1, 0.3)
        side = np.cross(eye, [0, 0, 1.0])
        side /= np.linalg.norm(side)
        light = np.cos(0.5 + 0.3 * (photo // 2)) * eye + np.sin(0.5 + 0.3 * (photo // 2)) * side
        normal = rng.normal(size=(4 * EACH, 3))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        normal = normal[(normal @ eye > 0.2) & (normal @ light > 0.05)][:EACH]
        n = len(normal)
        across = np.cross(side, eye)
        x, y = (0.4 * normal @ side).astype(np.float32), (0.4 * normal @ across).astype(np.float32)
        vector = np.ones((n, 3), np.float32)
        parts.append(
            Pixels(
                photo=np.full(n, photo, np.int16), material=np.zeros(n, np.int16),
                pixel=np.arange(n, dtype=np.int32), x=x, y=y, point=0.4 * normal,
                normal=normal.astype(np.float32), view=(eye * vector).astype(np.float32),
                light=(light * vector).astype(np.float32), irradiance=np.float32(np.pi) * vector,
                visible=np.ones(n, np.float32),
                edge=np.full(n, 8, np.float32), curvature=np.zeros(n, np.float32),
                observed=vector, noise=vector, slope=np.zeros((n, 2, 3), np.float32),
                veil=np.zeros((n, 2, 3), np.float32),
                background=np.full((n, 3, 3), np.nan, np.float32),
                turn=np.zeros((n, 2, 3), np.float32), step=np.zeros((n, 2, 3), np.float32),
                usable=np.ones(n, bool),
                block=(36 * photo + 6 * (x > 0) + 3 * (y > 0)
                       + np.digitize(np.hypot(x, y), (0.15, 0.28))).astype(np.int32),
            )
        )  # fmt: skip
    pixels = Pixels.join(parts)
    now = ShadingState.of(pixels)
    rho = brdf.evaluate(now.angles)
    radiance = rho * np.pi * np.sum(pixels.normal * pixels.light, axis=1, keepdims=True)
    noisy = radiance * (1 + NOISE * rng.standard_normal(radiance.shape))
    pixels = replace(
        pixels, observed=noisy.astype(np.float32), noise=np.square(NOISE * radiance),
        veil=np.broadcast_to(radiance.mean(axis=0), (len(radiance), 2, 3)),
    )  # fmt: skip
    triangle = Mesh(np.eye(3) * 1e-3, np.array([[0, 1, 2]], np.int32))
    return DiagnosisContext(
        pixels, MaterialBRDFs.of([brdf]), RayScene.build(triangle), np.arange(PHOTOS) // 2,
        ("a", "b", "c"), np.ones(3, bool), Rig.distant(PHOTOS), np.zeros(3), SIZE, np.pi,
        np.ones(1, np.float32),
    )  # fmt: skip


def shadowed(context: DiagnosisContext, photo: int, reach: float, lost: float) -> DiagnosisContext:
    """Return the ball with a darker round spot in one photo."""
    pixels = context.pixels
    spot = (pixels.photo == photo) & (np.hypot(pixels.x - 0.1, pixels.y) < reach)
    return changed(context, np.where(spot[:, None], 1 - lost, 1) * pixels.observed)


def changed(context: DiagnosisContext, observed: np.ndarray) -> DiagnosisContext:
    return replace(context, pixels=replace(context.pixels, observed=observed.astype(np.float32)))
