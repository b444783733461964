"""The charts of a BRDF, selected by name."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..errors import PatinaError
from .drawing import Drawing
from .highlight_curve import highlight_curve
from .image_slice import interval_slice, ratio_slice, reflectance_slice
from .polar import polar
from .sphere_view import sphere_view
from .subject import Show, Subject

CHARTS = ("sphere", "polar", "highlight", "slice", "interval", "ratio")
THETA_D_BIN = 4.0  # degrees, bin width of the histogram of the samples' θd


@dataclass(frozen=True)
class View:
    """Settings of all charts. Angles in degrees: incidence of the polar slice, theta_d of the
    highlight curve, phi_d of the image slices. exposure: of the lit sphere, in stops."""

    show: Show = field(default_factory=Show)
    incidence: float = 45.0
    theta_d: float = 20.0
    phi_d: float = 90.0
    exposure: float = 0.0


def chart(kind: str, subject: Subject, other: Subject | None, view: View) -> Drawing:
    """Draw one of CHARTS. Raises PatinaError for an unknown kind, for "interval" without an
    interval, and for "ratio" without a second BRDF."""
    both = [subject] if other is None else [subject, other]
    if kind == "sphere":
        return sphere_view(subject, other, view.exposure)
    if kind == "polar":
        return polar(both, view.incidence, view.show)
    if kind == "highlight":
        return highlight_curve(both, view.theta_d, view.show)
    if kind == "slice":
        return reflectance_slice(subject, view.phi_d, view.show)
    if kind == "interval":
        if subject.interval is None:
            raise PatinaError(
                f"found no 90 % interval for {subject.label}; expected a fit with one: fit it with "
                'method "measured"'
            )
        return interval_slice(subject, view.phi_d, view.show)
    if kind == "ratio":
        if other is None:
            raise PatinaError("found no material to compare with; choose one first")
        return ratio_slice(subject, other, view.phi_d, view.show)
    raise PatinaError(f"found {kind!r}; expected one of {', '.join(CHARTS)}")


def best_sampled_theta_d(subject: Subject) -> float | None:
    """The θd in degrees (centre of a bin) with most samples; None without samples."""
    if subject.points is None or not len(subject.points):
        return None
    bins = np.floor(np.degrees(subject.points.angles.theta_d) / THETA_D_BIN).astype(int)
    return float((np.bincount(bins).argmax() + 0.5) * THETA_D_BIN)
