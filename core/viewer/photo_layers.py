"""Pictures of a photo that the viewer compares: the photo, its prediction, their difference."""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..photo import write_jpeg

MAX_PHOTOS = 40  # in the page, evenly over those of the capture: its size is limited
PHOTO, PREDICTION, DIFFERENCE = "Photo", "Prediction", "Difference"
TEXTS = {
    PHOTO: "the photo",
    PREDICTION: "its prediction from the mesh, the light and the materials",
    DIFFERENCE: "prediction minus photo; red is too bright, blue too dark",
}


@dataclass(frozen=True)
class PhotoLayers:
    """name: of the photo; pictures: label → (h, w, 3) 8-bit display-encoded pixels, all of one
    size, the photo first; texts: label → what the layer shows, where that is not as in TEXTS."""

    name: str
    pictures: Mapping[str, NDArray[np.uint8]]
    texts: Mapping[str, str]


def shown_places(count: int) -> set[int]:
    """The places of the photos of a page with ``count`` photos: MAX_PHOTOS at most."""
    return set(np.linspace(0, count - 1, min(count, MAX_PHOTOS)).round().astype(int).tolist())


def page_data(photos: Sequence[PhotoLayers]) -> dict[str, Any]:
    """The photos as web/src/photos.js reads them."""
    shown = [photos[place] for place in sorted(shown_places(len(photos)))]
    texts = {label: text for photo in shown for label, text in photo.texts.items()}
    return {
        "photos": [
            {
                "name": photo.name,
                "layers": {label: _jpeg(picture) for label, picture in photo.pictures.items()},
            }
            for photo in shown
        ],
        "layer_texts": TEXTS | texts,
    }


def _jpeg(picture: NDArray[np.uint8]) -> str:
    """Base64 of a JPEG file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.jpg"
        write_jpeg(path, picture)
        return base64.b64encode(path.read_bytes()).decode("ascii")
