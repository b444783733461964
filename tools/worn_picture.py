"""docs/images/worn.jpg from a result of `run.py demo --worn`:

    python -m tools.worn_picture patina-demo

From left to right: a photo, its prediction, and the maps of the report.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from .common import ROOT

TARGET = ROOT / "docs" / "images" / "worn.jpg"
PICTURES = (
    "photo_00_photo", "photo_00_prediction", "varies_0_colour", "varies_0_specular",
    "varies_0_roughness",
)  # fmt: skip
HEIGHT, GAP = 330, 8  # pixels
DARK = 12 / 255  # of the black around a photo, which is cut off
MARGIN = 6  # pixels that stay


def main(result: Path) -> int:
    """Compose the picture."""
    panels = []
    for name in PICTURES:
        buffer = oiio.ImageBuf(str(result / "report" / f"{name}.png"))
        pixels = buffer.get_pixels(oiio.FLOAT)[..., :3]
        inside = np.abs(pixels - pixels[0, 0]).max(axis=-1) > DARK
        rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
        part = pixels[
            max(rows[0] - MARGIN, 0) : rows[-1] + MARGIN,
            max(columns[0] - MARGIN, 0) : columns[-1] + MARGIN,
        ]
        width = round(HEIGHT * part.shape[1] / part.shape[0])
        spec = oiio.ImageSpec(part.shape[1], part.shape[0], 3, oiio.FLOAT)
        whole = oiio.ImageBuf(spec)
        whole.set_pixels(spec.roi, np.ascontiguousarray(part))
        size = oiio.ROI(0, width, 0, HEIGHT, 0, 1, 0, 3)
        panels += [oiio.ImageBufAlgo.resize(whole, roi=size).get_pixels(oiio.FLOAT)]
        panels += [np.ones((HEIGHT, GAP, 3))]
    picture = np.concatenate(panels[:-1], axis=1)
    spec = oiio.ImageSpec(picture.shape[1], HEIGHT, 3, "uint8")
    spec.attribute("compression", "jpeg:85")
    out = oiio.ImageBuf(spec)
    out.set_pixels(spec.roi, np.ascontiguousarray(picture.astype(np.float32)))
    if not out.write(str(TARGET)):
        raise OSError(out.geterror())
    print(f"wrote {TARGET}: {TARGET.stat().st_size / 1000:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
