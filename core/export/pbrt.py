"""Export to pbrt-v4: a scene whose `measured` material reads NAME.bsdf."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..files import write_text_atomic
from ..views.sphere import KEY
from .mitsuba import IRRADIANCE

SCENE = """# A unit sphere of {title}, seen along -z, under one distant light; pbrt NAME.pbrt
Film "rgb" "integer xresolution" [ 256 ] "integer yresolution" [ 256 ]
    "string filename" [ "{name}.exr" ]
PixelFilter "box"
Sampler "zsobol" "integer pixelsamples" [ 64 ]
Integrator "path"
# pbrt is left-handed: mirrored, so that the picture is that of a right-handed scene
Scale -1 1 1
LookAt 0 0 5  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -1.05 1.05 -1.05 1.05 ]

WorldBegin
LightSource "distant" "point3 from" [ {light} ] "point3 to" [ 0 0 0 ]
    "rgb L" [ {power} {power} {power} ]

MakeNamedMaterial "{name}" "string type" "measured" "string filename" "{name}.bsdf"
NamedMaterial "{name}"
Shape "sphere" "float radius" 1
"""


def write_scene(path: Path, name: str, title: str) -> None:
    """Write the scene that reads NAME.bsdf in the same folder. name: an identifier; title: text of
    one line for the comment at the top."""
    light = " ".join(f"{v:.8g}" for v in KEY / np.linalg.norm(KEY))
    shown = " ".join(title.split()).encode("ascii", "replace").decode()
    text = SCENE.format(name=name, title=shown, light=light, power=f"{IRRADIANCE:.8g}")
    write_text_atomic(path, text)
