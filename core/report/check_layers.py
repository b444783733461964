"""The photos of a check in the viewer: predictions, residuals, and what each cause changes."""

from __future__ import annotations

import numpy as np

from ..diagnose.effects.labels import cause_label
from ..diagnose.forward.diagnosis_context import DiagnosisContext
from ..diagnose.selection.diagnosis import Diagnosis
from ..viewer.photo_layers import DIFFERENCE, PHOTO, PREDICTION, PhotoLayers, shown_places
from .residual_picture import (
    change_by,
    radiance_picture,
    residual_picture,
    scaled_residual,
    white_of,
)

SIDE = 420  # pixels of the longer side
BEFORE = "Difference Before Correction"
DIFFERENCE_TEXT = (
    "prediction minus photo, full colour at three times the standard deviation of the pixel's "
    "residual; red is too bright, blue too dark"
)


def check_layers(found: Diagnosis, context: DiagnosisContext) -> list[PhotoLayers]:
    """The photos that the check uses, as many as a page shows, at the pixels that it uses.
    Predictions and differences are those after correction."""
    pixels, layers = context.pixels, []
    after = scaled_residual(found, found.after)
    changes = {cause_label(t.effect.cause): -change_by(found, t) for t in found.named}
    texts = {
        PHOTO: "the photo, interpolated between the pixels that the check uses",
        PREDICTION: "its prediction at the same pixels, with the causes found",
        DIFFERENCE: DIFFERENCE_TEXT,
        BEFORE: f"without correction: {DIFFERENCE_TEXT}",
    }
    texts |= {
        label: f"what the cause '{label}' changes: red is brighter because of it, blue darker"
        for label in changes
    }
    photos = np.unique(pixels.photo).tolist()
    for photo in (photos[place] for place in sorted(shown_places(len(photos)))):
        white, names = white_of(pixels, photo), found.photo_names
        name = names[photo] if photo < len(names) else f"photo {photo + 1}"
        pictures = {
            PHOTO: radiance_picture(pixels, pixels.observed, photo, white, SIDE),
            PREDICTION: radiance_picture(pixels, found.after.predicted, photo, white, SIDE),
            DIFFERENCE: residual_picture(pixels, after, photo, SIDE),
        }
        if found.named:
            pictures[BEFORE] = residual_picture(pixels, found.before.residual, photo, SIDE)
        for label, changed in changes.items():
            pictures[label] = residual_picture(pixels, changed, photo, SIDE)
        layers.append(PhotoLayers(name, pictures, texts))
    return layers
