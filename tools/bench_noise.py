"""Measure the noise of the measured material under world images, relative to Cycles' closures."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SIZE, SAMPLES, SEEDS = 48, 64, 4
MATERIALS = (
    ("pink-fabric", "diffuse"), ("white-fabric", "diffuse"), ("blue-rubber", "diffuse"),
    ("alum-bronze", "glossy"), ("blue-acrylic", "glossy"), ("gold-metallic-paint", "glossy"),
)  # fmt: skip
WORLDS = ("forest", "interior", "sunset")


def run(data: Path) -> None:
    """Print the table of docs/method/measurements.md, section "Noise"."""
    from patina.core.appearance.closure_split import split
    from patina.core.appearance.principled_fit import fit_principled

    print(f"## noise ({SIZE} x {SIZE} pixels, {SAMPLES} samples, {SEEDS} seeds)\n")
    print(
        "| material | light through the portal | world | Patina | Cycles | closure of Cycles "
        "| ratio |"
    )
    print("|---|---|---|---|---|---|---|")
    ratios: dict[str, list[float]] = {"diffuse": [], "glossy": []}
    for name, kind in MATERIALS:
        brdf = brdf_of(data, name)
        fit = fit_principled(brdf.evaluate)
        roughness, rest = fit.principled.roughness, split(brdf.evaluate).rest
        for world in WORLDS:
            ours = _noise(world, lambda sphere, b=brdf, f=fit: _measured(sphere, b, f))
            own = _noise(world, lambda sphere, k=kind, r=roughness: _own(sphere, k, r))
            ratios[kind].append(ours / own)
            closure = "Diffuse" if kind == "diffuse" else f"Glossy, roughness {roughness:.2f}"
            print(
                f"| {name} | {100 * rest:.0f} % | {world} | {100 * ours:.1f} % | "
                f"{100 * own:.1f} % | {closure} | {ours / own:.2f} |",
                flush=True,
            )
    for kind, values in ratios.items():
        print(f"\n- {kind}: median {np.median(values):.2f}, largest {max(values):.2f}")


def brdf_of(data: Path, name: str):  # type: ignore[no-untyped-def]
    """Return a MERL material, projected on 100 components of the basis."""
    from patina.core.brdf import nbrdf
    from tests.projected import projected

    names, weights = nbrdf.load(data / "brdf" / "nbrdf_merl.npz")
    return projected(lambda angles: nbrdf.evaluate(weights[names.index(name)], angles), 100)


def _measured(sphere, brdf, fit) -> None:  # type: ignore[no-untyped-def]
    from patina.scene.material import material_nodes, osl_files

    files = osl_files.ensure_files(brdf)
    sphere.data.materials.append(material_nodes.create_material("measured", brdf, fit, files))


def _own(sphere, kind: str, roughness: float) -> None:  # type: ignore[no-untyped-def]
    from tests.wheel import cycles_sphere

    material = cycles_sphere.diffuse(0.8)
    if kind == "glossy":
        tree = material.node_tree
        node = tree.nodes.new("ShaderNodeBsdfAnisotropic")
        node.distribution = "GGX"
        node.inputs["Roughness"].default_value = roughness
        output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
        tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    sphere.data.materials.append(material)


def _noise(world: str, assign) -> float:  # type: ignore[no-untyped-def]
    """Return the noise: RMS over pixels of the standard deviation between seeds, relative to the
    mean radiance. assign: function that assigns a material to the sphere."""
    import bpy

    from patina.scene.export import relight
    from tests.wheel import cycles_sphere

    sphere = cycles_sphere.new_scene(size=SIZE, samples=SAMPLES, osl=True)
    scene = bpy.context.scene
    scene.cycles.filter_width = 1.0
    relight.light_with(scene, relight.shipped_worlds()[world])
    assign(sphere)
    images = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(SEEDS):
            scene.cycles.seed = seed
            images.append(cycles_sphere.render(Path(folder)).mean(axis=2))
    normal, inside = cycles_sphere.normals()
    kept: NDArray[np.bool_] = inside & (normal[..., 2] > 0.2)
    stack = np.array(images)[:, kept]
    return float(np.sqrt(np.mean(stack.var(axis=0, ddof=1))) / stack.mean())
