"""Measure how soon a rendered viewport shows an edit of the measured material or of a lamp.

The bpy module has no windows. A render with persistent data does the same as a viewport after an
edit: it calls the handlers of the extension, synchronises changes, compiles the shader and traces
the first sample. The first picture of a viewport is coarse; its pixels are COARSE times as large.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

WIDTH, HEIGHT = 960, 540
COARSE = 8  # per side
REPEATS = 7


def run(data: Path) -> None:
    """Print the table of docs/method/measurements.md, section "Edits"."""
    import bpy

    from patina.core.appearance.principled_fit import fit_principled
    from patina.scene.export import relight
    from patina.scene.material import lamp_inputs, material_nodes, osl_files, world_inputs
    from tests.wheel import cycles_sphere

    from .bench_noise import brdf_of

    brdf = brdf_of(data, "alum-bronze")
    sphere = cycles_sphere.new_scene(size=WIDTH, samples=1, osl=True)
    scene = bpy.context.scene
    scene.render.resolution_y = HEIGHT
    scene.render.use_persistent_data = True
    relight.light_with(scene, relight.shipped_worlds()["forest"])
    lamp = cycles_sphere.sun(np.array([0.5, 0.3, 0.8]))
    files = osl_files.ensure_files(brdf)
    material = material_nodes.create_material(
        "measured", brdf, fit_principled(brdf.evaluate), files
    )
    sphere.data.materials.append(material)
    (node,) = osl_files.script_nodes(material)
    inputs = {socket.identifier: socket for socket in node.inputs}

    def paint(step: int) -> None:
        inputs["body_scale"].default_value = (0.5 + 0.05 * step, 1.0, 1.0, 1.0)

    def turn(step: int) -> None:
        lamp.rotation_mode = "XYZ"
        lamp.rotation_euler = (0.3 + 0.1 * step, 0.2, 0.0)

    def strength(step: int) -> None:
        lamp.data.energy = 1.0 + step

    def add(step: int) -> None:
        cycles_sphere.sun(np.array([0.1 * step, 0.3, 0.8]))

    def none(step: int) -> None:
        pass

    edits: tuple[tuple[str, Callable[[int], None]], ...] = (
        ("nothing (a redraw)", none), ("paint of the material", paint),
        ("a sun turned", turn), ("a sun's strength", strength), ("a sun added", add),
    )  # fmt: skip
    faces = len(sphere.data.polygons)
    print(f"## edits ({WIDTH} x {HEIGHT} pixels, {faces} faces, medians of {REPEATS})\n")
    print("| edit | handlers | to the first, coarse picture | to a sample in every pixel |")
    print("|---|---|---|---|")
    lamp_inputs.register()
    world_inputs.register()
    try:
        with tempfile.TemporaryDirectory() as folder:
            scene.render.filepath = str(Path(folder) / "frame.png")
            for name, edit in edits:
                drawn = []
                for percentage in (100 // COARSE, 100):
                    scene.render.resolution_percentage = percentage
                    bpy.ops.render.render()
                    drawn.append([_seconds(edit, k) for k in range(REPEATS)])
                (update, first), (_, full) = np.median(drawn, axis=1)
                print(
                    f"| {name} | {update:.3f} s | {update + first:.2f} s | {update + full:.2f} s |"
                )
    finally:
        lamp_inputs.unregister()
        world_inputs.unregister()


def _seconds(edit: Callable[[int], None], step: int) -> tuple[float, float]:
    """Return seconds of (depsgraph update and handlers, render) after an edit."""
    import bpy

    start = time.perf_counter()
    edit(step)
    bpy.context.view_layer.update()
    updated = time.perf_counter()
    bpy.ops.render.render()
    return updated - start, time.perf_counter() - updated
