"""What a user should know about a material before trusting it, in sentences."""

from __future__ import annotations

import numpy as np

from ..appearance.energy import directional_albedo
from ..basis import PrincipalBRDF
from ..capture import Capture
from ..fit import PaperFit
from ..fit.measured_result import NINETY, MeasuredResult
from ..samples import SampleTable
from .estimators import Estimate

FEW_AT_PEAK = 200  # samples within 5° of the half vector
POOR = 0.2  # typical held-out error, and spread of the trials, that deserve a word
ODD_PHOTO = 5.0  # times the median held-out error of the photos
ODD_GAIN = 0.1  # of a photo against the others
BAD_NORMALS = 5.0  # degrees along each tangent
VIEWS = (0.0, 20.0, 40.0, 60.0, 70.0, 80.0)  # degrees from the normal
TOO_MUCH = 1.01  # of the light that falls on a surface: within the quadrature's error
BLACK, TOO_MANY_BLACK = 0.002, 0.1  # of the bright end; fraction of a photo's samples


def material_warnings(
    table: SampleTable, fit: PaperFit | MeasuredResult, irradiance_known: bool
) -> tuple[str, ...]:
    """What an artist should know about this material before trusting it."""
    found = list(fit.warnings)
    peak = table.read & (table.theta_h < np.radians(5))
    near_peak = round(float(table.weight[peak].sum(dtype=np.float64)))
    if near_peak < FEW_AT_PEAK:
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
    if irradiance_known:
        found += _too_much_light(fit.brdf)
    else:
        found.append("irradiance unknown: the BRDF is known up to one scale")
    return tuple(found)


def _too_much_light(brdf: PrincipalBRDF) -> list[str]:
    albedo = directional_albedo(brdf.evaluate, np.radians(VIEWS)).max(axis=1)
    most = int(albedo.argmax())
    if albedo[most] <= TOO_MUCH:
        return []
    return [
        f"seen from {VIEWS[most]:.0f}° it reflects {100 * albedo[most]:.0f} % of the light that "
        "falls on it; its material in Cycles is held to 100 %: check the irradiance of the lights"
    ]


def trust_warnings(found: Estimate, capture: Capture) -> tuple[str, ...]:
    """Where the fit itself says that it is poor, or that one photo does not belong."""
    held, spread, said = found.held_out, found.spread, []
    if held is not None and held.typical > POOR:
        said.append(
            "poor: the typical pixel of a photo it has not seen is off by "
            f"{100 * held.typical:.0f} %"
        )
    if isinstance(found.fit, MeasuredResult):
        said += _doubts(found.fit, spread.median, capture)
    elif spread.median > POOR:
        said.append(
            f"unstable: other random pixels give another material (± {100 * spread.median:.0f} %)"
        )
    if held is not None and len(held.per_photo) > 2:
        usual = float(np.median(list(held.per_photo.values())))
        said += [
            f"{capture.photo_name(photo)} is predicted {error / usual:.0f} times worse than the "
            "others: check its camera, light and exposure, or it shows an angle that they do not"
            for photo, error in held.per_photo.items()
            if error > ODD_PHOTO * usual
        ]
    return tuple(said)


def _doubts(fit: MeasuredResult, deviation: float, capture: Capture) -> list[str]:
    """What the measured fit knows of its own input."""
    said = [
        f"{capture.photo_name(photo)} is {abs(100 * (gain - 1)):.0f} % "
        f"{'brighter' if gain > 1 else 'darker'} than the other photos say: check its exposure "
        "and its light's irradiance"
        for photo, gain in fit.odd_gains(ODD_GAIN).items()
    ]
    if fit.normal_deviation > BAD_NORMALS:
        said.append(
            f"the mesh's normals are off by {fit.normal_deviation:.0f}°: check that mesh and "
            "cameras belong together, or make a finer mesh"
        )
    if deviation > POOR:
        off = 100 * np.expm1(NINETY * deviation)
        said.append(
            f"unsure: in half of all directions the reflectance may be off by more than {off:.0f} "
            "% (90 % interval); photos under more angles would tell"
        )
    return said


def black_photos(table: SampleTable, capture: Capture) -> tuple[str, ...]:
    """Photos where much of what should be lit is black: they show something else."""
    found = []
    level = table.radiance.mean(axis=1)
    for photo in np.unique(table.photo).tolist():
        which = table.photo == photo
        own, weight = level[which], table.weight[which].astype(np.float64)
        dark = own < BLACK * np.percentile(own, 95)
        if weight[dark].sum() > TOO_MANY_BLACK * weight.sum():
            found.append(
                f"{capture.photo_name(photo)} is black where its light should reach: is this the "
                "camera it was taken with, and this its light?"
            )
    return tuple(found)
