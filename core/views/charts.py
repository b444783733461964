"""The charts by name, and what each needs."""

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
BIN = 4.0  # degrees


@dataclass(frozen=True)
class View:
    """How charts are looked at. Angles in degrees: incidence of the polar slice, theta_d of the
    highlight curve, phi_d of the image slices. exposure: of the sphere, in stops."""

    show: Show = field(default_factory=Show)
    incidence: float = 45.0
    theta_d: float = 20.0
    phi_d: float = 90.0
    exposure: float = 0.0


def chart(kind: str, subject: Subject, other: Subject | None, view: View) -> Drawing:
    """One of CHARTS. Raises PatinaError where what it shows is not known."""
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
                f"nothing is known of how far {subject.label} may be off: fit it with method "
                '"measured"'
            )
        return interval_slice(subject, view.phi_d, view.show)
    if kind == "ratio":
        if other is None:
            raise PatinaError("nothing to compare with: choose it first")
        return ratio_slice(subject, other, view.phi_d, view.show)
    raise PatinaError(f"found {kind!r}; expected one of {', '.join(CHARTS)}")


def most_measured(subject: Subject) -> float | None:
    """θd in degrees where most samples are; None without any."""
    if subject.points is None or not len(subject.points):
        return None
    place = np.floor(np.degrees(subject.points.angles.theta_d) / BIN).astype(int)
    return float((np.bincount(place).argmax() + 0.5) * BIN)
