"""Data stored on a measured material for charts: samples, interval, and the previous fit."""

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

COLUMNS = 7  # columns of MeasuredPoints.rows


def keep_evidence(material: bpy.types.Material, fitted: MaterialResult) -> None:
    """Store the samples and the interval on the material, some hundred kilobytes."""
    material[SAMPLE_POINTS] = _stored(fitted.points.rows())
    if isinstance(fitted.fit, MeasuredResult):
        material[INTERVAL_BAND] = _stored(fitted.fit.band.values)


def keep_earlier(material: bpy.types.Material, old: bpy.types.Material) -> None:
    """Store the coefficients of the replaced fit, for comparison. If both fits are equal, store
    those of the fit before."""
    same = list(old[COEFFICIENTS]) == list(material[COEFFICIENTS])
    pairs = ((EARLIER_COEFFICIENTS, EARLIER_BASIS),) if same else ((COEFFICIENTS, BASIS_VERSION),)
    for coefficients, basis in pairs:
        if coefficients in old:
            material[EARLIER_COEFFICIENTS] = list(old[coefficients])
            material[EARLIER_BASIS] = old[basis]


def has_earlier(material: bpy.types.Material) -> bool:
    """Whether the material stores an earlier fit."""
    return EARLIER_COEFFICIENTS in material


def subject_of(material: bpy.types.Material, label: str = "") -> Subject:
    """The material as measured, with its samples and interval, for charts.

    Raises PatinaError if its basis is not on this computer.
    """
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
    """The earlier fit, for charts. Raises PatinaError if there is none, or if its basis is not on
    this computer."""
    if not has_earlier(material):
        raise PatinaError(
            f"{material.name} was fitted only once; there is no earlier fit to compare with"
        )
    brdf = brdf_of(material[EARLIER_BASIS], material[EARLIER_COEFFICIENTS])
    if brdf is None:
        raise _without_basis(material.name)
    return Subject("earlier fit", brdf.evaluate)


def _without_basis(name: str) -> PatinaError:
    return PatinaError(f"The basis of {name} is not on this computer; fit the material again")


def _stored(values: NDArray[np.floating]) -> array[float]:
    return array("f", np.ascontiguousarray(values, np.float32).tobytes())
