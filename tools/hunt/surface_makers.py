"""Effects of the surface: normal errors, second material, subsurface scattering, anisotropy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patina.core.basis import PrincipalBRDF

from .drawn import random_brdf
from .scene import Hidden, Scene, blended, find_size, rms
from .shape import bumpy

Array = np.ndarray

MAX_BUMP = 0.03  # scan units


def normals(scene: Scene) -> Hidden:
    """The surface has bumps that the mesh lacks, or the mesh has bumps that the surface lacks."""
    seed, wave = int(scene.rng.integers(1 << 30)), scene.rng.uniform(9, 16)
    rough = bool(scene.rng.random() < 0.5)

    def photos(scene: Scene, size: float) -> list[Array]:
        scene.studio.shape(bumpy(scene.surface, size, wave, seed))
        scene.studio.dress(scene.studio.measured(scene.brdf))
        return scene.photographed()

    size, found, strength = scene.at_strength(photos, 0.002, most=MAX_BUMP)
    if rough:
        wrong_surface = bumpy(scene.surface, size, wave, seed)
        return Hidden(scene.plain, {"bumps": size}, strength, surface=wrong_surface)
    return Hidden(found, {"bumps": size}, strength)


def second(scene: Scene) -> Hidden:
    """A part of the surface is a mixture with another measured material."""
    _, other = random_brdf(scene.brdf.basis, scene.rng)
    at = scene.rng.normal(size=3)
    at /= np.linalg.norm(at)
    part = scene.rng.uniform(0.15, 0.35)
    reach = scene.surface.points @ at
    border = np.quantile(reach, 1 - part)
    scene.studio.dress_part(scene.studio.measured(other), reach > border)
    return scene.in_part(scene.once("second"), "part", 1.0)


def subsurface(scene: Scene) -> Hidden:
    """Subsurface scattering of a part of the light; without the effect this part is Lambertian."""
    colour = scene.rng.uniform(0.4, 0.9, 3)
    scene.studio.noise_free(256)
    scene.studio.bounce(0)
    scene.studio.dress(scene.studio.matte(colour))
    matte = scene.once("matte")
    scene.studio.dress(scene.studio.translucent(colour, scene.rng.uniform(0.05, 0.15)))
    deep = scene.once("deep")
    level = np.mean([p.mean() for p in scene.plain]) / np.mean([p.mean() for p in matte])

    def photos(what: list[Array], share: float) -> list[Array]:
        return blended(scene.plain, [level * w for w in what], share)

    share = find_size(
        lambda s: rms(photos(deep, s), photos(matte, s)), 0.2, scene.strength, most=1.0
    )
    found = photos(deep, share)
    return Hidden(found, {"part": share}, rms(found, photos(matte, share)))


def brushed(scene: Scene) -> Hidden:
    """A mixture of matte paint and brushed metal; without the effect the metal is isotropic."""
    rough, shine = scene.rng.uniform(0.25, 0.45), scene.rng.uniform(0.1, 0.4)
    scene.studio.dress(scene.studio.matte(scene.rng.uniform(0.1, 0.6, 3)))
    matte = scene.photographed()

    def photos(scene: Scene, anisotropy: float) -> list[Array]:
        scene.studio.dress(scene.studio.brushed(rough, anisotropy))
        return blended(scene.plain, scene.photographed(), shine)

    scene = replace(scene, plain=matte)
    plain, small = photos(scene, 0.0), photos(scene.small, 0.0)
    size = find_size(lambda s: rms(photos(scene.small, s), small), 0.1, scene.strength, most=0.9)
    found = photos(scene, size)
    return Hidden(found, {"anisotropy": size}, rms(found, plain))


def outside(scene: Scene) -> Hidden:
    """The BRDF has a ring around its highlight, or is brighter at some difference angles."""
    ring = bool(scene.rng.random() < 0.5)
    middle = np.radians(scene.rng.uniform(12, 25))

    def photos(scene: Scene, size: float) -> list[Array]:
        scene.studio.dress(scene.studio.measured(_with_lobe(scene.brdf, ring, middle, size)))
        return scene.photographed()

    size, found, changed = scene.at_strength(photos, 0.2, most=2.5)
    return Hidden(found, {"ring" if ring else "angle": size}, changed)


def _with_lobe(brdf: PrincipalBRDF, ring: bool, middle: float, size: float) -> PrincipalBRDF:
    """Add a Gaussian bump of height ``size`` to ln ρ, over θh (ring) or θd."""
    basis = brdf.basis
    nodes = basis.grid.nodes()
    at = nodes.theta_h if ring else nodes.theta_d
    wide = np.radians(2.0 if ring else 4.0)
    bump = np.exp(-0.5 * np.square((at - middle) / wide)).astype(np.float32)
    bump = np.broadcast_to(bump, basis.grid.shape)
    components = np.concatenate([basis.components, bump[None]])
    extended = replace(basis, components=components, training=None)
    extra = np.full((3, 1), size)
    return PrincipalBRDF(extended, np.concatenate([brdf.coefficients, extra], axis=1))
