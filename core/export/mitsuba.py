"""Export to Mitsuba 3: Patina's plugin, which evaluates the BRDF exactly, and Mitsuba's `measured`.

NAME.xml uses the plugin (RGB variants of Mitsuba). NAME_spectral.xml needs no Python and uses
NAME.bsdf (spectral variants). Both show the same sphere under the same light.
"""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ET  # written, never read
from pathlib import Path

import numpy as np

from ..files import atomic_path
from ..result import FittedMaterial
from ..views.sphere import KEY
from .file_names import identifier
from .table_files import log_table_arrays, write_npz

PLUGIN = Path(__file__).parents[2] / "assets" / "mitsuba"
PLUGIN_FILES = ("patina_bsdf.py", "render.py")
IRRADIANCE = 3.14159265  # a white diffuse surface facing the light has radiance 1


def write_material(folder: Path, material: FittedMaterial) -> list[str]:
    """Write NAME_mitsuba.npz and NAME.xml; returns their names."""
    name = identifier(material.name)
    principled = material.principled
    lobe = principled.roughness
    if principled.coat_weight > 0.05:
        lobe = min(lobe, principled.coat_roughness)
    write_npz(
        folder / f"{name}_mitsuba.npz",
        **log_table_arrays(material.brdf),
        # measured lobes have longer tails than the fitted one
        sampling_alpha=np.array(float(np.clip((1.1 * lobe) ** 2, 0.002, 1.0))),
        sampling_share=np.array(0.5),
    )
    write_scene(folder / f"{name}.xml", "patina", f"{name}_mitsuba.npz")
    return [f"{name}_mitsuba.npz", f"{name}.xml"]


def write_plugin(folder: Path) -> list[str]:
    """Copy the plugin and its render script into ``folder``; returns their names."""
    for name in PLUGIN_FILES:
        shutil.copyfile(PLUGIN / name, folder / name)
    return list(PLUGIN_FILES)


def write_scene(path: Path, plugin: str, file: str) -> None:
    """Write a scene: a unit sphere, an orthographic camera that looks along −z, a distant light."""
    root = ET.Element("scene", version="3.0.0")
    ET.SubElement(root, "default", name="spp", value="64")
    ET.SubElement(root, "default", name="size", value="256")
    ET.SubElement(root, "integrator", type="path")
    sensor = ET.SubElement(root, "sensor", type="orthographic")
    placed = ET.SubElement(sensor, "transform", name="to_world")
    ET.SubElement(placed, "scale", x="1.05", y="1.05")
    ET.SubElement(placed, "lookat", origin="0, 0, 5", target="0, 0, 0", up="0, 1, 0")
    sampler = ET.SubElement(sensor, "sampler", type="stratified")
    ET.SubElement(sampler, "integer", name="sample_count", value="$spp")
    film = ET.SubElement(sensor, "film", type="hdrfilm")
    ET.SubElement(film, "integer", name="width", value="$size")
    ET.SubElement(film, "integer", name="height", value="$size")
    ET.SubElement(film, "string", name="pixel_format", value="rgb")
    ET.SubElement(film, "string", name="component_format", value="float32")
    ET.SubElement(film, "rfilter", type="box")
    light = ET.SubElement(root, "emitter", type="directional")
    towards = -KEY / np.linalg.norm(KEY)
    ET.SubElement(light, "vector", name="direction", value=_vector_text(towards))
    ET.SubElement(light, "rgb", name="irradiance", value=_vector_text([IRRADIANCE] * 3))
    sphere = ET.SubElement(root, "shape", type="sphere")
    bsdf = ET.SubElement(sphere, "bsdf", type=plugin)
    ET.SubElement(bsdf, "string", name="filename", value=file)
    ET.indent(root, "  ")
    with atomic_path(path) as partial:
        ET.ElementTree(root).write(partial, encoding="utf-8", xml_declaration=True)


def _vector_text(values: object) -> str:
    """Numbers separated by commas, as Mitsuba expects a vector."""
    return ", ".join(f"{float(v):.8g}" for v in np.ravel(np.asarray(values, float)))
