"""Make one capture with one hidden effect: `make(folder, causes, strength, seed)`.

The shape, the material, the lights, the cameras and the details of the effect are drawn from the
seed. The size of the effect is chosen such that the photos change by the requested RMS. The truth
is returned, and never written where a diagnosis could read it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import trimesh

from patina.core.basis import default_basis

from . import camera_faults, camera_makers, light_makers, surface_makers
from .drawn import LIGHTS, SIZE, random_brdf, random_shots
from .scene import IRRADIANCE, Hidden, Scene, Shot
from .shape import lumpy
from .studio import HuntStudio

Array = np.ndarray

CAPTURE = "hunt.capture.toml"
PLAIN = "plain"  # name of the photos without an effect

MAKERS: dict[str, Callable[[Scene], Hidden]] = {
    "light_direction": light_makers.direction,
    "light_intensity": light_makers.intensity,
    "near_light": light_makers.near,
    "area_light": light_makers.area,
    "ambient_light": light_makers.room,
    "environment_reflection": light_makers.window,
    "interreflection": light_makers.bounced,
    "cast_shadow": light_makers.shadow,
    "camera_response": camera_makers.tone,
    "clipping": camera_makers.clipping,
    "vignetting": camera_makers.vignetting,
    "veiling_glare": camera_makers.veil,
    "camera_pose": light_makers.pose,
    "normal_error": surface_makers.normals,
    "second_material": surface_makers.second,
    "anisotropy": surface_makers.brushed,
    "subsurface": surface_makers.subsurface,
    "outside_basis": surface_makers.outside,
}
"""Cause of the diagnosis → function that hides it."""

OUTSIDERS: dict[str, Callable[[Scene], Hidden]] = {
    "smudge": camera_makers.smudge,
    "moire": camera_makers.moire,
    "white_balance": camera_makers.white_balance,
}
"""Effects that are no cause of the diagnosis: `unknown` is the right result."""

ON_PICTURES = ("light_intensity", "camera_response", "clipping", "vignetting", "veiling_glare")
"""Effects that can be applied to photos with another effect."""


@dataclass(frozen=True)
class Truth:
    """What is hidden in a capture. strength: relative RMS change of the photos; parameters:
    true values of the effect; material: index of the training material."""

    cause: str
    strength: float
    parameters: Mapping[str, float]
    material: int
    seed: int


def make(folder: Path, cause: str, strength: float, seed: int) -> Truth:
    """Write capture file, mesh, cameras and photos to ``folder``, and return the truth.

    cause: "none", a key of MAKERS or OUTSIDERS, or two keys joined by +, the second of ON_PICTURES.
    strength: requested relative RMS change of the photos.
    """
    scene, material = _scene(seed)
    scene = replace(scene, plain=scene.once(PLAIN), strength=strength)
    makers = {**MAKERS, **OUTSIDERS}
    hidden = hidden_by(makers, scene, [] if cause == "none" else cause.split("+"))
    photos = camera_faults.with_noise(hidden.photos, scene.rng)
    _write(folder, hidden.surface or scene.surface, hidden.stated_shots or scene.shots, photos)
    return Truth(cause, hidden.strength, hidden.parameters, material, seed)


def make_plain(folder: Path, seed: int) -> Truth:
    """Write the same capture without an effect, and with other noise."""
    scene, material = _scene(seed)
    noise = np.random.default_rng([seed, 8])
    _write(folder, scene.surface, scene.shots, camera_faults.with_noise(scene.once(PLAIN), noise))
    return Truth("none", 0.0, {}, material, seed)


@lru_cache(maxsize=1)
def _kept(seed: int) -> dict[str, list[Array]]:
    """Cache of the photos that all causes and strengths of a seed share (Scene.once)."""
    return {}


def _scene(seed: int) -> tuple[Scene, int]:
    """Return the scene of a seed, without photos, and the index of its material."""
    rng = np.random.default_rng([seed, 7])
    studio = HuntStudio()
    surface = lumpy(seed)
    studio.shape(surface)
    material, brdf = random_brdf(default_basis(), rng)
    studio.dress(studio.measured(brdf))
    return Scene(studio, surface, brdf, random_shots(rng), [], 0.0, rng, _kept(seed)), material


def hidden_by(
    makers: Mapping[str, Callable[[Scene], Hidden]], scene: Scene, causes: Sequence[str]
) -> Hidden:
    """Apply one effect after the other. makers: cause → function that hides it."""
    found = Hidden(scene.plain)
    for cause in causes:
        made = makers[cause](replace(scene, plain=found.photos))
        found = replace(
            made,
            parameters={**found.parameters, **made.parameters},
            strength=max(found.strength, made.strength),
            stated_shots=made.stated_shots or found.stated_shots,
            surface=made.surface or found.surface,
        )
    return found


def _write(folder: Path, surface, shots: list[Shot], photos: list[Array]) -> None:  # type: ignore[no-untyped-def]
    (folder / "lit").mkdir(parents=True, exist_ok=True)
    trimesh.Trimesh(surface.points, surface.triangles, process=False).export(folder / "mesh.ply")
    frames = []
    for k, shot in enumerate(shots):
        camera = shot.camera
        frames.append(
            {
                "file_path": f"view_{k}.jpg", "fl_x": camera.focal, "fl_y": camera.focal,
                "cx": camera.centre[0], "cy": camera.centre[1], "w": SIZE[0], "h": SIZE[1],
                "transform_matrix": camera.to_world.tolist(),
            }
        )  # fmt: skip
    (folder / "transforms.json").write_text(json.dumps({"frames": frames}), "utf-8")
    lines = ["[scan]", 'cameras = "transforms.json"', 'mesh = "mesh.ply"', ""]
    for k in range(LIGHTS):
        direction = ", ".join(f"{v:.6f}" for v in shots[2 * k].light)
        lines += ["[[light]]", f'name = "light {k + 1}"', f"direction = [{direction}]"]
        lines += [f"irradiance = [{IRRADIANCE}, {IRRADIANCE}, {IRRADIANCE}]", ""]
    for k, image in enumerate(photos):
        name = f"lit/photo_{k}.exr"
        spec = oiio.ImageSpec(SIZE[0], SIZE[1], 3, oiio.HALF)
        target = oiio.ImageBuf(spec)
        target.set_pixels(oiio.ROI(), image.astype(np.float32))
        target.write(str(folder / name))
        lines += ["[[photo]]", f'file = "{name}"', f'camera = "view_{k}.jpg"']
        lines += [f'light = "light {k // 2 + 1}"', ""]
    (folder / CAPTURE).write_text("\n".join(lines), "utf-8")
