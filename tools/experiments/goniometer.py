"""Paints measured by a gonioreflectometer (Cornell): photos simulated from the measurement, fitted,
and compared with the measured values themselves.

No model of Patina was trained on them, and they are no encodings: the directions between the
measured ones come from a thin-plate spline through the measurements, not from any basis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from patina.core.angles import Angles, half_difference
from patina.core.brdf import TabulatedBRDF

from . import estimators, materials, scenes
from .runs import Records

PAINTS = ("acryl_blue", "garnet_red")
SCENES = ("pebble-wavy", "bunny-openmvs", "jar-bumpy")
BANDS = ((600, 690), (500, 590), (400, 490))  # nm: means of them are R, G and B
NOISE_FLOOR = 1e-3  # 1/sr, a reflectance of 0.3 %: darker readings are too noisy for logarithms
# 1/sr: the basis cannot tell darker values from black, because ε of its mapping is 1e-3
ABOVE_EPSILON = 5e-3
NEIGHBOURS = 8  # of a measured direction
KNEE = np.radians(3.0)  # θh is logarithmic above it in the spline: highlights are narrow
SMOOTHING = 0.02  # of the spline, whose error on directions left out it hardly changes
PEAK = np.radians(10.0)  # of θh
ROWS = ("paper", "all samples k=20", "ours", estimators.MERL_PRIOR)


@dataclass(frozen=True)
class Paint:
    """One measured paint. angles, rho: the n measured directions and (n, 3) values in 1/sr;
    compared: (n, 3) whether a value is above the noise and no lost reading; table: the spline on
    the MERL grid."""

    angles: Angles
    rho: NDArray[np.float64]
    compared: NDArray[np.bool_]
    table: TabulatedBRDF

    def evaluate(self, angles: Angles) -> NDArray[np.float32]:
        """ρ (n, 3) in 1/sr of the table; 0 beyond its last cells at the horizon."""
        return np.maximum(self.table.evaluate(angles), 0)


def tasks(quick: bool) -> list[tuple[str, str]]:
    """Return (scene, paint) of each task."""
    if quick:
        return [(SCENES[0], PAINTS[1])]
    return [(scene, paint) for scene in SCENES for paint in PAINTS]


def work(task: tuple[str, str]) -> Records:
    """Return the records of one task."""
    scene, name = task
    paint = measured(name)
    sampled = scenes.sampled(scene)
    light = sampled.true.transport(paint.evaluate)
    common = {"scene": scene, "material": name, "seed": 0}
    found: Records = [
        {**common, "estimator": "spline", **errors(paint, paint.evaluate(paint.angles))}
    ]
    for row in estimators.rows().values():
        if row.name not in ROWS:
            continue
        basis = materials.full_basis(row.components, row.merl_prior)
        fit = row.estimator(sampled.exposed(light, 0), basis, 0)
        record = {**common, "estimator": row.name, **errors(paint, fit.evaluate(paint.angles))}
        if (interval := estimators.interval(fit)) is not None:
            low, high = interval(paint.angles)
            inside = (paint.rho >= low) & (paint.rho <= high)
            record["inside"] = float(inside[paint.compared].mean())
        found.append(record)
    return found


def errors(paint: Paint, rho: NDArray[np.floating]) -> dict[str, float]:
    """Return the RMS and the median of |ln(fit ÷ measured)| of the values that are compared, and
    the RMS of those with θh below PEAK and of those above ABOVE_EPSILON."""
    kept = paint.compared
    off = np.log(np.maximum(np.asarray(rho, float), 1e-6) / np.maximum(paint.rho, 1e-9))
    near = kept & (paint.angles.theta_h < PEAK)[:, None]
    return {
        "log_rms": float(np.sqrt(np.mean(off[kept] ** 2))),
        "typical": float(np.median(np.abs(off[kept]))),
        "peak_rms": float(np.sqrt(np.mean(off[near] ** 2))),
        "brighter_rms": float(np.sqrt(np.mean(off[kept & (paint.rho > ABOVE_EPSILON)] ** 2))),
    }


@lru_cache(maxsize=2)
def measured(name: str) -> Paint:
    """Read a paint of the reference data."""
    angles, rho = read(materials.data_folder() / "brdf" / "cornell" / f"{name}.brdf")
    wrong = lost(angles, rho)
    channels = [_spline(angles, rho[:, c], ~wrong[:, c]) for c in range(3)]
    table = TabulatedBRDF.from_function(
        lambda wanted: np.stack([channel(wanted) for channel in channels], axis=1)
    )
    return Paint(angles, rho, (rho > NOISE_FLOOR) & ~wrong, table)


def _spline(
    angles: Angles, values: NDArray[np.floating], kept: NDArray[np.bool_]
) -> Callable[[Angles], NDArray[np.float64]]:
    """Return the spline of ln ρ of one channel; it never leaves the range of the values."""
    logs = np.log(np.maximum(values[kept], NOISE_FLOOR / 10))
    spline = RBFInterpolator(coordinates(angles)[kept], logs, smoothing=SMOOTHING)

    def evaluate(wanted: Angles) -> NDArray[np.float64]:
        return np.exp(np.clip(spline(coordinates(wanted)), logs.min(), logs.max()))

    return evaluate


def read(path: Path) -> tuple[Angles, NDArray[np.float64]]:
    """Read a file of the Cornell format: (angles (n,), ρ (n, 3) in 1/sr).

    Numbers, separated by spaces or lines; # begins a comment. First the number of wavelengths, then
    these, nm, then for each direction θi, φi, θs, φs in radians and its values.
    """
    text = "\n".join(line.partition("#")[0] for line in path.read_text().splitlines())
    numbers = np.array(text.split(), float)
    count = int(numbers[0])
    wavelength, rows = numbers[1 : 1 + count], numbers[1 + count :].reshape(-1, 4 + count)
    light, view = (direction(*rows[:, i : i + 2].T) for i in (0, 2))
    normal = np.broadcast_to([0.0, 0.0, 1.0], light.shape)
    bands = [(wavelength >= low) & (wavelength <= high) for low, high in BANDS]
    rho = np.stack([rows[:, 4:][:, band].mean(axis=1) for band in bands], axis=1)
    return half_difference(normal, light, view), rho


def direction(theta: NDArray[np.floating], phi: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return unit vectors (n, 3)."""
    return np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1
    )


def coordinates(angles: Angles) -> NDArray[np.float64]:
    """Return (n, 3) coordinates in which an isotropic, reciprocal BRDF is smooth: φd only counts as
    its cosine of twice the angle, and less the closer half vector or light are to the pole."""
    theta_h, theta_d, phi_d = (np.asarray(a, float) for a in angles)
    return np.stack(
        [np.log1p(theta_h / KNEE), theta_d, np.sin(theta_h) * np.sin(theta_d) * np.cos(2 * phi_d)],
        axis=1,
    )


def lost(angles: Angles, rho: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return (n, 3) whether a value is a lost reading: below half the median of those measured
    closest to it, above NOISE_FLOOR. No paint has a dip as narrow as the step of the measurement.
    """
    places = coordinates(angles)
    near = cKDTree(places).query(places, NEIGHBOURS + 1)[1][:, 1:]
    level = np.median(rho[near], axis=1)
    return np.asarray((rho < 0.5 * level) & (level > NOISE_FLOOR))
