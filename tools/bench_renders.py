"""Renders of a painted surface whose material varies, by every branch of its Blender material.

The photos are rendered by Cycles from an exact mesh and a Principled BSDF with painted colour
(tests/wheel/maps_scene.py); the fit gets a mesh with a tenth of the triangles. The result's scene
is rendered from the photos' cameras under their lamps, and compared with the photos and with the
OSL material, in sRGB, on the pixels that show the lit surface.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import bpy

VIEWS = (0, 1, 2, 3, 4, 6, 8, 9)  # photos of which renders are made
SAMPLES = 16
WHITE = 99.0  # percentile of the photo's radiance that is shown as white
SCENE, GLB = "scene.blend", "scan.glb"
SHADERS = {"OSL": "SCRIPT", "lobe stack": "GROUP", "Principled": "BSDF_PRINCIPLED"}
"""Branch of the material → type of its shader node."""


def run(_: Path) -> None:
    """Print the table."""
    import bpy

    import patina
    from patina.core.capture import read_capture
    from patina.core.jobs import FitJob, finished
    from patina.core.jobs.varying.varying_job import VaryingJob
    from patina.scene.export.blend_file import write_blend
    from patina.scene.export.export_gltf import write_glb
    from tests.wheel import maps_scene

    patina.register()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        maps_scene.photograph(folder)
        job = VaryingJob(FitJob(read_capture(maps_scene.write_scan(folder))), "always")
        job.drain()
        write_blend(folder / SCENE, folder / SCENE, finished(job.result), job.stages)
        write_glb(folder / GLB, [bpy.context.scene.patina.mesh])
        branches: dict[str, Callable[[], None]] = {
            label: (lambda kind=kind: _use_branch(kind)) for label, kind in SHADERS.items()
        }
        branches["glTF"] = lambda: _use_glb(folder / GLB)
        renders = {label: _renders(folder, use) for label, use in branches.items()}
        photos = {view: maps_scene.photo(folder, view) for view in VIEWS}
    print("\nPainted surface, 12 photos fitted; mean and worst of 8 views:\n")
    print("| material | typical error to the photo | PSNR to the photo | PSNR to the OSL render |")
    print("|---|---|---|---|")
    for label, images in renders.items():
        typical = [_typical(images[v], photos[v]) for v in VIEWS]
        photo = [_psnr(images[v], photos[v], photos[v]) for v in VIEWS]
        shown = "–"
        if label != "OSL":
            exact = [_psnr(images[v], renders["OSL"][v], photos[v]) for v in VIEWS]
            shown = f"{np.mean(exact):.1f} dB ({np.min(exact):.1f})"
        print(
            f"| {label} | {100 * np.mean(typical):.1f} % | {np.mean(photo):.1f} dB "
            f"({np.min(photo):.1f}) | {shown} |"
        )


def _renders(folder: Path, use: Callable[[], None]) -> dict[int, NDArray[np.float32]]:
    """View → its render with one branch of the material."""
    import bpy

    from patina.scene.material.lamp_inputs import update_lamps

    bpy.ops.wm.open_mainfile(filepath=str(folder / SCENE))
    use()
    scene = bpy.context.scene
    lamps = {thing.name: thing for thing in scene.objects if thing.type == "LIGHT"}
    cameras = [thing for thing in scene.objects if thing.type == "CAMERA"]
    found = {}
    for view in VIEWS:
        scene.camera = next(camera for camera in cameras if f"{view:02d}" in camera.name)
        for name, lamp in lamps.items():
            lamp.hide_render = name != f"sun{view}"
        bpy.context.view_layer.update()
        update_lamps(scene)
        found[view] = _render(scene, folder / "render.exr")
    return found


def _render(scene: bpy.types.Scene, path: Path) -> NDArray[np.float32]:
    """The scene's render with direct light only, as the photos are."""
    import bpy
    import OpenImageIO as oiio

    from tests.wheel import maps_scene

    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.filepath = str(path)
    scene.render.resolution_x, scene.render.resolution_y = maps_scene.WIDTH, maps_scene.HEIGHT
    scene.render.resolution_percentage = 100
    cycles = scene.cycles
    cycles.samples, cycles.max_bounces, cycles.seed = SAMPLES, 0, 1
    cycles.use_denoising, cycles.pixel_filter_type = False, "BOX"
    bpy.ops.render.render(write_still=True)
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT), np.float32)[..., :3]


def _use_branch(kind: str) -> None:
    """Let Cycles render the branch with this type of shader node."""
    from patina.scene.material.measured_materials import measured_materials

    for material in measured_materials():
        tree = material.node_tree
        output = next(n for n in tree.nodes if getattr(n, "target", "") == "CYCLES")
        shader = next(n for n in tree.nodes if n.type == kind)
        for other in [n for n in tree.nodes if n.type == "SCRIPT" and n != shader]:
            tree.nodes.remove(other)  # the extension would link it again
        tree.links.new(shader.outputs["BSDF"], output.inputs["Surface"])


def _use_glb(path: Path) -> None:
    """Show the mesh of a GLB, as Blender imports it, in place of the scanned one."""
    import bpy

    mesh = bpy.context.scene.patina.mesh
    bpy.ops.import_scene.gltf(filepath=str(path))
    mesh.hide_render = True


def _shown(values: NDArray[np.float32], white: float) -> NDArray[np.float32]:
    from patina.core.photo.transfer import srgb_encoded

    return srgb_encoded(np.clip(values / white, 0, 1)).astype(np.float32)


def _psnr(
    image: NDArray[np.float32], other: NDArray[np.float32], photo: NDArray[np.float32]
) -> float:
    """dB, of the lit pixels in sRGB."""
    lit = photo.sum(axis=-1) > 0
    white = float(np.percentile(photo[lit], WHITE))
    difference = (_shown(image, white) - _shown(other, white))[lit]
    return float(-10 * np.log10(np.mean(np.square(difference))))


def _typical(image: NDArray[np.float32], photo: NDArray[np.float32]) -> float:
    """Median relative error of the lit pixels."""
    lit = photo.min(axis=-1) > 0
    return float(np.median(np.abs(image - photo)[lit] / photo[lit]))
