"""Write the viewer: one HTML file with its program and its data, which opens without a network.

The program (web/src, built into assets/viewer/viewer.js by tools/viewer_program.py) evaluates the
BRDF for each pixel from the table of logarithms that the coefficients give at the nodes of the
basis' grid. The page states which model it shows.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..basis import AngleGrid, mapping
from ..errors import InputError
from ..files import write_text_atomic
from .model_tables import INTERVAL_STEP, ViewerMaterial
from .photo_layers import PhotoLayers, page_data
from .skies import Sky
from .viewer_object import ViewerObject

ASSETS = Path(__file__).parents[2] / "assets" / "viewer"
PROGRAM = ASSETS / "viewer.js"
FILE_NAME = "viewer.html"


def has_program() -> bool:
    """Whether the program of the viewer was built (a checkout has none before `run.py build`)."""
    return PROGRAM.is_file()


def write_viewer(
    path: Path,
    title: str,
    materials: Sequence[ViewerMaterial],
    skies: Sequence[Sky],
    thing: ViewerObject | None = None,
    notes: Sequence[str] = (),
    photos: Sequence[PhotoLayers] = (),
) -> None:
    """Write the page. thing: the object that wears the materials; without it a sphere does. notes:
    sentences below the controls. photos: to be compared with their predictions. Raises InputError
    where the program was not built."""
    if not has_program():
        raise InputError(
            "The program of the viewer is missing; expected it in assets/viewer/viewer.js; "
            "`python3 run.py build` makes it"
        )
    data = _data(materials, skies, thing) | page_data(photos)
    words = {
        "TITLE": escape(title),
        "STYLE": (ASSETS / "style.css").read_text("utf-8"),
        "NOTES": "".join(f'<p class="note">{escape(note)}</p>' for note in notes),
        # "<" could end the script element, or begin a comment in it
        "DATA": json.dumps(data, separators=(",", ":")).replace("<", "\\u003c"),
        "PROGRAM": PROGRAM.read_text("utf-8").replace("</script", "<\\/script"),
    }
    first, *rest = (ASSETS / "page.html").read_text("utf-8").split("@")
    # every second piece is a word between two at signs
    parts = [words[piece] if place % 2 == 0 else piece for place, piece in enumerate(rest)]
    write_text_atomic(path, first + "".join(parts))


def _data(
    materials: Sequence[ViewerMaterial], skies: Sequence[Sky], thing: ViewerObject | None
) -> dict[str, Any]:
    """The data as web/src/data.js reads them."""
    grid: AngleGrid = materials[0].grid
    out: dict[str, Any] = {
        "grid": {
            "n_h": grid.n_h,
            "n_d": grid.n_d,
            "n_p": grid.n_p,
            "knee": grid.knee,
            "epsilon": mapping.EPSILON,
        },
        "interval_step": INTERVAL_STEP,
        "materials": [
            {
                "name": material.name,
                "models": {name: {"table": _text(t)} for name, t in material.tables.items()},
                "body": material.body,
                "interval": None if material.interval is None else _text(material.interval),
            }
            for material in materials
        ],
        "worlds": [
            {
                "name": sky.name,
                "width": sky.radiance.shape[1],
                "height": sky.radiance.shape[0],
                "pixels": _text(sky.radiance.astype(np.float16)),
            }
            for sky in skies
        ],
        "object": None,
    }
    if thing is not None:
        out["object"] = {
            "positions": _text(thing.positions),
            "parts": [
                {
                    "material": part.material,
                    "index": _text(part.corners),
                    "factors": None if part.factors is None else _text(part.factors),
                }
                for part in thing.parts
            ],
        }
    return out


def _text(values: NDArray[Any]) -> str:
    """Base64 of the numbers in memory, little-endian."""
    ordered = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    return base64.b64encode(ordered.tobytes()).decode("ascii")
