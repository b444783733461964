"""Make a capture of a scan as it is: stereo mesh, poses with errors, a material of no basis, and at
most one hidden effect. The truth is returned, and never written where a diagnosis could read it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import trimesh

from ..demo_render import Camera
from ..experiments import shapes
from ..hunt import camera_faults, camera_makers, light_makers
from ..hunt.make import hidden_by
from ..hunt.scene import IRRADIANCE, Hidden
from . import makers, materials
from .renderer import Renderer
from .scans import BUNNIES, OWN, FieldScan, field_scan
from .scene import DISTANT, FLASH, LAMPS, LIGHTS, NEAR, PHOTOS, FieldScene, draw_lighting

Array = np.ndarray

CAPTURE = "field.capture.toml"
EXPOSED = 99.7  # percentile of the object's pixels that an 8-bit photo shows as white
QUALITY = 95  # of JPEG
CAMERA = {
    "camera_response": camera_makers.tone, "clipping": camera_makers.clipping,
    "vignetting": camera_makers.vignetting, "veiling_glare": camera_makers.veil,
    "light_intensity": light_makers.intensity, "black_level": makers.black_level,
    "ambient_light": makers.room, "second_material": makers.second_material,
}  # fmt: skip
MAKERS: dict[str, dict[str, Callable[..., Hidden]]] = {
    DISTANT: {
        "light_direction": light_makers.direction, "near_light": makers.near,
        "cast_shadow": makers.shadow, **CAMERA,
    },
    NEAR: {"near_light": makers.near_elsewhere, **CAMERA},
    FLASH: {"flash_offset": makers.flash_offset, **CAMERA},
}  # fmt: skip
"""Kind of lamp → cause of the diagnosis → function that hides it."""


@dataclass(frozen=True)
class Truth:
    """What is hidden in a capture. lamp: kind; scan, material: names; encoding: of the photos;
    varies: whether the albedo does. strength: relative RMS change of the photos; parameters: true
    values of the effect, in the frame of the capture. white: radiance of the parameters that is 1
    in the photos."""

    cause: str
    wanted: float
    seed: int
    lamp: str
    scan: str
    material: str
    encoding: str
    varies: bool
    strength: float
    parameters: dict[str, float]
    white: float = 1.0


def setting(seed: int) -> tuple[str, str, str, str, bool]:
    """(lamp, scan, material, encoding, whether the albedo varies) of a seed. Half of
    the seeds have distant lamps; the rest is drawn."""
    rng = np.random.default_rng([seed, 11])
    lamp = LAMPS[0] if seed % 2 == 0 else LAMPS[1 + (seed // 2) % 2]
    scan = (*BUNNIES, *OWN)[int(rng.integers(len(BUNNIES) + len(OWN)))]
    material = str(rng.choice(materials.names()))
    encoding = "jpeg" if rng.random() < 1 / 3 else "exr"
    return lamp, scan, material, encoding, bool(rng.random() < 1 / 3)


def make(folder: Path, cause: str, strength: float, seed: int) -> Truth:
    """Write a capture to ``folder``. cause: "none", a cause of MAKERS for the lamp of this seed, or
    two joined by +."""
    lamp, name, material, encoding, varies = setting(seed)
    rng = np.random.default_rng([seed, 12])
    scan = field_scan(name, PHOTOS, rng)
    renderer = Renderer(scan.exact, materials.all_materials(), [material])
    if varies:
        renderer.factor = _albedo(rng)
    lights = draw_lighting(rng, lamp, list(scan.cameras))
    scene = FieldScene(
        None, scan.exact, None, lights.shots, [], strength, rng, renderer=renderer, lamp=lamp,
        positions=lights.positions, offset=lights.offset, distance=lights.distance,
    )  # fmt: skip
    scene = replace(scene, plain=scene.photographed())
    hidden = hidden_by(MAKERS[lamp], scene, [] if cause == "none" else cause.split("+"))
    photos = camera_faults.with_noise(hidden.photos, rng)
    white = _white(photos) if encoding == "jpeg" else 1.0
    _write(folder, scan, scene, hidden, [photo / white for photo in photos], encoding, white)
    return Truth(
        cause, strength, seed, lamp, name, material, encoding, varies, hidden.strength,
        {k: float(v) for k, v in hidden.parameters.items()}, white,
    )  # fmt: skip


def _albedo(rng: np.random.Generator) -> Callable[[Array], Array]:
    """Points → factors of the reflectance: soft stains, and paint of another shade in patches."""
    seed = int(rng.integers(1 << 30))
    large, small, patch = (
        shapes.waves(length, seed + k) for k, length in enumerate((0.25, 0.08, 0.5))
    )
    tint = rng.normal(0, 0.12, 3) - 0.1

    def factor(points: Array) -> Array:
        stains = 0.12 * large(points) + 0.06 * small(points)
        paint = 0.5 * (1 + np.tanh(12 * (patch(points) - 0.6)))
        return np.minimum(np.exp(stains[:, None] + paint[:, None] * tint), 1.3)

    return factor


def _write(
    folder: Path, scan: FieldScan, scene: FieldScene, hidden: Hidden, photos: list[Array],
    encoding: str, white: float,
) -> None:  # fmt: skip
    """Write the capture. photos: as they are stored, with 1 at ``white``."""
    (folder / "lit").mkdir(parents=True, exist_ok=True)
    trimesh.Trimesh(scan.mesh.vertices, scan.mesh.faces, process=False).export(folder / "mesh.ply")
    frames = [_frame(k, camera) for k, camera in enumerate(scan.stated)]
    (folder / "transforms.json").write_text(json.dumps({"frames": frames}), "utf-8")
    lines = ["[scan]", 'cameras = "transforms.json"', 'mesh = "mesh.ply"', ""]
    lines += _lights(scene, hidden, white)
    for k, image in enumerate(photos):
        name = f"lit/photo_{k}.{'jpg' if encoding == 'jpeg' else 'exr'}"
        write_photo(folder / name, image)
        lines += ["[[photo]]", f'file = "{name}"', f'camera = "view_{k}.png"']
        lines += [f'light = "{_light_of(scene, k)}"', "exposure = 1", ""]
    (folder / CAPTURE).write_text("\n".join(lines), "utf-8")


def _frame(k: int, camera: Camera) -> dict[str, object]:
    return {
        "file_path": f"view_{k}.png", "fl_x": camera.focal, "fl_y": camera.focal,
        "cx": camera.centre[0], "cy": camera.centre[1], "w": camera.size[0], "h": camera.size[1],
        "transform_matrix": camera.to_world.tolist(),
    }  # fmt: skip


def _light_of(scene: FieldScene, photo: int) -> str:
    return "flash" if scene.lamp == FLASH else f"light {photo // 2 + 1}"


def _lights(scene: FieldScene, hidden: Hidden, white: float) -> list[str]:
    """The lights as the capture file states them."""
    shots, lines = hidden.stated_shots or scene.shots, []
    if scene.lamp == FLASH:
        return [
            "[[light]]", 'name = "flash"', f"mounted = {toml_numbers(scene.offset)}",
            f"intensity = {toml_numbers(np.full(3, scene.intensity / white))}", "",
        ]  # fmt: skip
    for k in range(LIGHTS):
        lines += ["[[light]]", f'name = "light {k + 1}"']
        if scene.lamp == NEAR:
            strength = np.full(3, scene.intensity_of(k) / white)
            lines += [f"position = {toml_numbers(scene.positions[k])}"]
            lines += [f"intensity = {toml_numbers(strength)}", ""]
        else:
            lines += [f"direction = {toml_numbers(shots[2 * k].light)}"]
            lines += [f"irradiance = {toml_numbers(np.full(3, IRRADIANCE / white))}", ""]
    return lines


def toml_numbers(values: Array) -> str:
    """Numbers as an array of a capture file."""
    return "[" + ", ".join(f"{v:.8g}" for v in values) + "]"


def _white(photos: list[Array]) -> float:
    return max(float(np.percentile(p[p.max(axis=2) > 0], EXPOSED)) for p in photos)


def write_photo(path: Path, linear: Array) -> None:
    """Write linear radiance as half-float EXR, or as an 8-bit sRGB JPEG."""
    height, width, _ = linear.shape
    if path.suffix == ".exr":
        spec, values = oiio.ImageSpec(width, height, 3, oiio.HALF), linear
    else:
        spec = oiio.ImageSpec(width, height, 3, oiio.UINT8)
        spec.attribute("compression", f"jpeg:{QUALITY}")
        spec.attribute("jpeg:subsampling", "4:4:4")
        values = srgb(np.clip(linear, 0, 1))
    target = oiio.ImageBuf(spec)
    target.set_pixels(oiio.ROI(), np.ascontiguousarray(values, np.float32))
    target.write(str(path))


def srgb(linear: Array) -> Array:
    """Encode linear values 0..1 (IEC 61966-2-1)."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
