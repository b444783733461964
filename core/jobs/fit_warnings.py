"""Warnings about a fitted material, in sentences for the user."""

from __future__ import annotations

import numpy as np

from ..appearance.energy import directional_albedo
from ..basis import PrincipalBRDF
from ..capture import Capture
from ..fit import PaperFit
from ..fit.measured_result import NINETY_PERCENT, MeasuredResult
from ..samples import SampleTable
from .estimators import Estimate

MIN_PEAK_SAMPLES = 200  # samples with the half vector within 5° of the normal
MAX_TYPICAL_ERROR = 0.2  # limit of the held-out error and of the uncertainty, relative
ODD_PHOTO_RATIO = 5.0  # held-out error of a photo over the median of all photos
ODD_GAIN = 0.1  # relative brightness of a photo against the others
MAX_LISTED_PHOTOS = 4  # names in a sentence
MAX_NORMAL_ERROR = 5.0  # degrees along each tangent
VIEW_ANGLES = (0.0, 20.0, 40.0, 60.0, 70.0, 80.0)  # degrees from the normal
MAX_ALBEDO = 1.01  # reflected over incident light: 1 plus the error of the quadrature
DARKEST = 0.005  # albedo along the normal of the darkest material of MERL
MIN_ALBEDO = 0.8 * DARKEST
BLACK_LEVEL, MAX_BLACK_SHARE = 0.002, 0.1  # of a photo's 95th percentile; of its samples


def material_warnings(
    table: SampleTable, fit: PaperFit | MeasuredResult, irradiance_known: bool
) -> tuple[str, ...]:
    """Warnings about the samples and the BRDF of one material, one sentence or more each.

    table: the samples that the material was fitted to; irradiance_known: False where the BRDF is
    known only up to one scale factor.
    """
    found = list(fit.warnings)
    peak = table.read & (table.theta_h < np.radians(5))
    near_peak = round(float(table.weight[peak].sum(dtype=np.float64)))
    if near_peak < MIN_PEAK_SAMPLES:
        found.append(
            f"Only {near_peak} samples are within 5° of the highlight's peak, so the height of the "
            "highlight is uncertain. Add a photo that shows the highlight."
        )
    far = float(np.percentile(table.theta_d, 98)) if len(table) else 0.0
    if far < np.radians(50):
        found.append(
            "The angle between light and camera is less than "
            f"{2 * np.degrees(far):.0f}° for 98 % of the samples. Reflectance at grazing angles "
            "comes from the basis, not from this object. Add photos with the light farther from "
            "the camera."
        )
    if irradiance_known:
        found += _energy_warnings(fit.brdf)
    else:
        found.append(
            "The irradiance of the lights is unknown, so the BRDF is known only up to one scale "
            "factor. To get absolute values, add a white target, or give the irradiance."
        )
    return tuple(found)


def _energy_warnings(brdf: PrincipalBRDF) -> list[str]:
    """A warning where the BRDF reflects more light than it receives (directional albedo > 1), or
    less than any material: then the stated irradiance is wrong."""
    albedo = directional_albedo(brdf.evaluate, np.radians(VIEW_ANGLES)).max(axis=1)
    worst = int(albedo.argmax())
    if albedo[0] < MIN_ALBEDO:
        return [
            f"The material reflects only {100 * albedo[0]:.2g} % of the light that comes along "
            f"the normal; the darkest measured material reflects {100 * DARKEST:g} %. Check the "
            "irradiance of the lights and the exposures."
        ]
    if albedo[worst] <= MAX_ALBEDO:
        return []
    return [
        f"Viewed {VIEW_ANGLES[worst]:.0f}° from the normal, the material reflects "
        f"{100 * albedo[worst]:.0f} % of the incident light. Renders limit it to 100 %. Check the "
        "irradiance of the lights: it must be at least "
        f"{np.ceil(100 * albedo[worst]) / 100:g} times as large."
    ]


def quality_warnings(found: Estimate, capture: Capture) -> tuple[str, ...]:
    """Warnings from the quality measures of the fit: held-out error, uncertainty, and photos that
    do not agree with the others."""
    held, spread, warnings = found.held_out, found.spread, []
    if held is not None and held.typical > MAX_TYPICAL_ERROR:
        warnings.append(
            "Large error: the typical pixel of a held-out photo is off by "
            f"{100 * held.typical:.0f} %. Run Check to find the cause."
        )
    if isinstance(found.fit, MeasuredResult):
        warnings += _measured_warnings(found.fit, spread.median, capture)
    elif spread.median > MAX_TYPICAL_ERROR:
        warnings.append(
            "Unstable: trials with other random pixels give a different material "
            f"(± {100 * spread.median:.0f} %). Add photos from more angles."
        )
    if held is not None and len(held.per_photo) > 2:
        median = float(np.median(list(held.per_photo.values())))
        odd = {p: e for p, e in held.per_photo.items() if e > ODD_PHOTO_RATIO * median}
        if odd:
            warnings.insert(
                0,
                f"The held-out error of {_photos(capture, list(odd))} is at least "
                f"{min(odd.values()) / median:.0f} times the median of all photos. Check camera, "
                "light and exposure. If they are right, no other photo shows these angles.",
            )
    return tuple(warnings)


def _measured_warnings(fit: MeasuredResult, std: float, capture: Capture) -> list[str]:
    """Warnings of the measured method. std: median standard deviation of ln ρ."""
    warnings = []
    gains = fit.gains_beyond(ODD_GAIN)
    if gains:
        shown = ", ".join(
            f"{capture.photo_name(photo)} by {100 * (gain - 1):+.0f} %"
            for photo, gain in list(gains.items())[:MAX_LISTED_PHOTOS]
        )
        more = f" and {len(gains) - MAX_LISTED_PHOTOS} more" * (len(gains) > MAX_LISTED_PHOTOS)
        warnings.append(
            "The brightness differs from what the other photos predict: "
            f"{shown}{more}. Check the exposures and the irradiance of the lights."
        )
    if fit.normal_deviation > MAX_NORMAL_ERROR:
        warnings.append(
            f"The mesh's normals are off by about {fit.normal_deviation:.0f}° along each tangent. "
            "Check that mesh and cameras belong together, or use a finer mesh."
        )
    if std > MAX_TYPICAL_ERROR:
        off = 100 * np.expm1(NINETY_PERCENT * std)
        warnings.append(
            "Uncertain: in half of all directions the reflectance may be off by more than "
            f"{off:.0f} % (90 % interval). Add photos from more angles."
        )
    return warnings


def black_photo_warnings(table: SampleTable, capture: Capture) -> tuple[str, ...]:
    """A warning about the photos in which many samples are black although the light reaches them.

    The usual cause is a wrong light or a wrong camera.
    """
    black = []
    level = table.radiance.mean(axis=1)
    for photo in np.unique(table.photo).tolist():
        which = table.photo == photo
        own, weight = level[which], table.weight[which].astype(np.float64)
        dark = own < BLACK_LEVEL * np.percentile(own, 95)
        if weight[dark].sum() > MAX_BLACK_SHARE * weight.sum():
            black.append(photo)
    if not black:
        return ()
    verb = "is" if len(black) == 1 else "are"
    return (
        f"{_photos(capture, black)} {verb} black where the light should reach: the light or the "
        "camera is wrong. Find the light from the photos, and check the outline of the mesh over "
        "the photo.",
    )


def _photos(capture: Capture, places: list[int]) -> str:
    """Names of a few photos, and the number of the others."""
    names = [capture.photo_name(place) for place in places[:MAX_LISTED_PHOTOS]]
    more = len(places) - len(names)
    if more:
        return f"{', '.join(names)} and {more} more"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
