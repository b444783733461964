"""What a user should know about a material before trusting it, in sentences."""

from __future__ import annotations

import numpy as np

from ..capture import Capture
from ..fit import PaperFit
from ..fit.held_out import HeldOut
from ..fit.spread import Spread
from ..samples import SampleTable

FEW_AT_PEAK = 200  # samples within 5° of the half vector
POOR = 0.2  # typical held-out error, and spread of the trials, that deserve a word
ODD_PHOTO = 5.0  # times the median held-out error of the photos
BLACK, TOO_MANY_BLACK = 0.002, 0.1  # of the bright end; fraction of a photo's samples


def material_warnings(table: SampleTable, fit: PaperFit, irradiance_known: bool) -> tuple[str, ...]:
    """What an artist should know about this material before trusting it."""
    found = list(fit.warnings)
    near_peak = int((table.theta_h < np.radians(5)).sum())
    if near_peak < 200:
        found.append(
            f"only {near_peak} samples lie within 5° of the highlight: its height is a guess; "
            "add a photo that shows the highlight"
        )
    far = float(np.percentile(table.theta_d, 98)) if len(table) else 0.0
    if far < np.radians(50):
        found.append(
            f"no photo has the light more than {2 * np.degrees(far):.0f}° from the camera: "
            "grazing reflection comes from the basis, not from this object"
        )
    if not irradiance_known:
        found.append("irradiance unknown: the BRDF is known up to one scale")
    return tuple(found)


def trust_warnings(held: HeldOut | None, spread: Spread, capture: Capture) -> tuple[str, ...]:
    """Where the fit itself says that it is poor, or that one photo does not belong."""
    found = []
    if held is not None and held.typical > POOR:
        found.append(
            "poor: the typical pixel of a photo it has not seen is off by "
            f"{100 * held.typical:.0f} %"
        )
    if spread.median > POOR:
        found.append(
            f"unstable: other random pixels give another material (± {100 * spread.median:.0f} %)"
        )
    if held is not None and len(held.per_photo) > 2:
        usual = float(np.median(list(held.per_photo.values())))
        found += [
            f"{capture.photo_name(photo)} is predicted {error / usual:.0f} times worse than the "
            "others: check its camera, light and exposure, or it shows an angle that they do not"
            for photo, error in held.per_photo.items()
            if error > ODD_PHOTO * usual
        ]
    return tuple(found)


def black_photos(table: SampleTable) -> list[int]:
    """Photos where much of what should be lit is black: they show something else."""
    found = []
    level = table.radiance.mean(axis=1)
    for photo in np.unique(table.photo):
        own = level[table.photo == photo]
        dark = own < BLACK * np.percentile(own, 95)
        if dark.mean() > TOO_MANY_BLACK:
            found.append(int(photo))
    return found
