"""On a measured material: the samples and the interval that charts show, and the fit before it."""

from __future__ import annotations

from array import array
from functools import partial

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.errors import PatinaError
from ...core.fit.measured_result import Band, MeasuredResult
from ...core.jobs import MaterialResult
from ...core.samples import MeasuredPoints
from ...core.views.subject import Subject
from ..property_keys import (
    BASIS_VERSION,
    COEFFICIENTS,
    EARLIER_BASIS,
    EARLIER_COEFFICIENTS,
    INTERVAL_BAND,
    SAMPLE_POINTS,
)
from .trait_offsets import brdf_of, measured_brdf

COLUMNS = 7  # of MeasuredPoints.rows


def keep_evidence(material: bpy.types.Material, fitted: MaterialResult) -> None:
    """What the material was measured by, some hundred kilobytes: it stays with it in the .blend."""
    material[SAMPLE_POINTS] = _stored(fitted.points.rows())
    if isinstance(fitted.fit, MeasuredResult):
        material[INTERVAL_BAND] = _stored(fitted.fit.band.values)


def keep_earlier(material: bpy.types.Material, old: bpy.types.Material) -> None:
    """The fit that this one replaces, for comparison; where both say the same, the one before."""
    same = list(old[COEFFICIENTS]) == list(material[COEFFICIENTS])
    pairs = ((EARLIER_COEFFICIENTS, EARLIER_BASIS),) if same else ((COEFFICIENTS, BASIS_VERSION),)
    for numbers, basis in pairs:
        if numbers in old:
            material[EARLIER_COEFFICIENTS] = list(old[numbers])
            material[EARLIER_BASIS] = old[basis]


def has_earlier(material: bpy.types.Material) -> bool:
    """Whether a fit before this one is known."""
    return EARLIER_COEFFICIENTS in material


def subject_of(material: bpy.types.Material, label: str = "") -> Subject:
    """As measured, with its samples and its interval. Raises PatinaError where this computer lacks
    its basis."""
    brdf = measured_brdf(material)
    if brdf is None:
        raise _without_basis(material.name)
    interval = points = None
    if INTERVAL_BAND in material:
        band = Band.from_values(np.array(material[INTERVAL_BAND], np.float32), brdf.basis.grid.knee)
        interval = partial(band.interval, brdf)
    if SAMPLE_POINTS in material:
        rows = np.array(material[SAMPLE_POINTS], np.float32).reshape(-1, COLUMNS)
        points = MeasuredPoints.from_rows(rows)
    return Subject(label or material.name, brdf.evaluate, interval, points)


def earlier_subject(material: bpy.types.Material) -> Subject:
    """The fit before. Raises PatinaError where there is none."""
    if not has_earlier(material):
        raise PatinaError(f"{material.name} was fitted once only: no earlier fit to compare with")
    brdf = brdf_of(material[EARLIER_BASIS], material[EARLIER_COEFFICIENTS])
    if brdf is None:
        raise _without_basis(material.name)
    return Subject("earlier fit", brdf.evaluate)


def _without_basis(name: str) -> PatinaError:
    return PatinaError(
        f"the components that {name} was measured in are not on this computer: fit it again"
    )


def _stored(values: NDArray[np.floating]) -> array[float]:
    return array("f", np.ascontiguousarray(values, np.float32).tobytes())
