"""Photos that fit a Blender camera: those of a distorted lens are resampled."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from ...core.geometry.rectify import rectify
from ...core.photo import read_encoded, write_exr, write_png
from ...core.scan import Camera


def photo_for(camera: Camera, photo: Path, folder: Path) -> Path:
    """The photo itself if its lens is a pinhole, else a rectified copy in ``folder``."""
    if camera.pinhole:
        return photo
    folder.mkdir(parents=True, exist_ok=True)
    # cameras of a rig may store photos of the same name in different folders
    place = hashlib.sha256(str(photo.resolve().parent).encode()).hexdigest()[:6]
    pixels = rectify(read_encoded(photo), camera, camera.rectified())
    if photo.suffix.lower() in (".exr", ".hdr"):
        target = folder / f"{photo.stem}_rectified_{place}.exr"
        write_exr(target, pixels, half=True)
    else:
        target = folder / f"{photo.stem}_rectified_{place}.png"
        write_png(target, (np.clip(pixels, 0, 1) * 255 + 0.5).astype(np.uint8))
    return target
