"""`run.py pictures`: render docs/images/demo.jpg from the embedded capture, and diagnosis.jpg
(hunt/picture.py); `run.py pictures demo`: only the first.

From left to right: a lit photo, the differences to its prediction without and with the causes that
the check finds, and the materials under another environment (Cycles, OSL).
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio

from .common import ROOT
from .package import load_patina

TARGET = ROOT / "docs" / "images" / "demo.jpg"
PHOTO = 0  # index in the capture: the key light from the front, whose camera sees the relit scene
EXPLAINED = 3  # of the photo whose differences are shown; its lamp's other photo was exposed more
HEIGHT = 420  # pixels of each panel
WHITE_PERCENTILE = 99.5  # of the photo, with its black surroundings
GAP = 12  # pixels between panels
SAMPLES = 1024  # per pixel


def main() -> int:
    """Fit, render and compose; return the exit code."""
    patina = load_patina()
    patina.register()
    from patina.commands.demo import CAPTURE
    from patina.commands.diagnose import diagnose_to_folder
    from patina.core.capture import read_capture
    from patina.core.geometry import RayScene, view_surface
    from patina.core.inputs import capture_data
    from patina.core.views import display

    from .hunt.picture import make as diagnosis_picture

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "demo"
        diagnose_to_folder(CAPTURE, out)
        capture = read_capture(CAPTURE)
        scan = capture_data.open_scan(capture)
        rays = RayScene.build(scan.mesh)
        boxes = [
            display.crop_box(
                view_surface(rays, capture_data.camera_of(capture, scan, place)).seen, margin=margin
            )
            for place, margin in ((PHOTO, 12), (EXPLAINED, 0))
        ]
        panels = [lit_photo(CAPTURE.parent / capture.photos[EXPLAINED].file)[boxes[1]]]
        for kind in ("before", "after"):
            panels.append(read(out / "report" / f"residual_{EXPLAINED:02d}_{kind}.png"))
        panels.append(relit(out / "scene.blend", Path(folder), boxes[0]))
    TARGET.parent.mkdir(parents=True, exist_ok=True)
    write(TARGET, with_gaps([of_height(panel, HEIGHT) for panel in panels], axis=1))
    print(f"wrote {TARGET}: {TARGET.stat().st_size / 1000:.0f} kB")
    if sys.argv[1:] != ["demo"]:
        diagnosis_picture()
    return 0


def relit(blend: Path, folder: Path, box: tuple[slice, slice]) -> np.ndarray:
    """Render (h, w, 3) the materials under a world of Blender, cropped like the other panels."""
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    scene = bpy.context.scene
    for lamp in [o for o in scene.objects if o.type == "LIGHT"]:
        lamp.hide_render = True
    worlds = Path(bpy.utils.system_resource("DATAFILES")) / "studiolights" / "world"
    tree = scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexEnvironment")
    sky.image = bpy.data.images.load(str(worlds / "courtyard.exr"))
    turn, place = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(place.outputs["Generated"], turn.inputs["Vector"])
    tree.links.new(turn.outputs["Vector"], sky.inputs["Vector"])
    up = scene.camera.matrix_world.to_3x3() @ type(scene.camera.location)((0, 1, 0))
    turn.inputs["Rotation"].default_value = up.rotation_difference((0, 0, 1)).to_euler()
    background = tree.nodes["Background"]
    tree.links.new(sky.outputs["Color"], background.inputs["Color"])
    background.inputs["Strength"].default_value = 1.0
    scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, False
    # film_transparent stays off: rays that pass through portals would become transparent too
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(folder / "relit.png")
    bpy.ops.render.render(write_still=True)
    return read(Path(scene.render.filepath))[box]


def of_height(pixels: np.ndarray, height: int) -> np.ndarray:
    """Resample (h, w, 3) 8-bit pixels to a height."""
    source = oiio.ImageBuf(oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8"))
    source.set_pixels(oiio.ROI(), np.ascontiguousarray(pixels))
    width = round(pixels.shape[1] * height / pixels.shape[0])
    return oiio.ImageBufAlgo.resize(
        source, roi=oiio.ROI(0, width, 0, height, 0, 1, 0, 3)
    ).get_pixels(oiio.UINT8)


def with_gaps(panels: Sequence[np.ndarray], axis: int) -> np.ndarray:
    """Join panels (h, w, 3) of equal size along the other axis, with white gaps."""
    shape = list(panels[0].shape)
    shape[axis] = GAP
    strip = [np.full(shape, 255, np.uint8)] * (2 * len(panels) - 1)
    strip[::2] = panels
    return np.concatenate(strip, axis=axis)


def lit_photo(path: Path) -> np.ndarray:
    """(h, w, 3) 8-bit pixels of a linear photo, its highlights clipped."""
    from patina.core.views import display

    radiance = oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)[..., :3]
    return display.photo_picture(radiance, display.white_level(radiance, WHITE_PERCENTILE))


def read(path: Path) -> np.ndarray:
    """Read (h, w, 3) 8-bit pixels."""
    return oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8)[..., :3]


def write(path: Path, pixels: np.ndarray) -> None:
    """Write a JPEG file for the docs."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")
    spec.attribute("Compression", "jpeg:88")
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), spec)
    out.write_image(np.ascontiguousarray(pixels))
    out.close()


if __name__ == "__main__":
    sys.exit(main())
