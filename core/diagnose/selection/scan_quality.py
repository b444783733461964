"""How good the scan is, as the photos show it: normals, poses, material and albedo."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..effects.camera_pose import CameraPose
from ..forward.basis_slack import COUNT
from ..nuisances.fine_variation import log_albedo_of_patches
from ..nuisances.surface_variation import ALBEDO, TILTS, WAYS, SurfaceVariation
from ..solver.model_fit import ModelFit
from .cross_validation import parameter_variances

# up to the first a figure is good, above the second it is poor, and the check names it as a cause
# degrees, RMS over patches: stereo meshes have 1 to 1.7
GOOD_NORMALS, UNUSUAL_NORMALS = 1.7, 2.5
# pixels along an axis: reconstructions have 0.3; errors of a mesh look like 1
GOOD_POSES, UNUSUAL_POSES = 0.5, 1.5
# RMS of ln of the factor by which a material differs from the basis; good: half of what is named
GOOD_MATERIAL, UNUSUAL_MATERIAL = 0.15, 0.3
BRIGHT = 0.1  # of the 90th percentile of the prediction; darker pixels are not counted


@dataclass(frozen=True)
class ScanQuality:
    """normals: degrees by which the normals of surface patches are off, RMS. poses: pixels by which
    the photos are displaced along each axis, RMS. outside: RMS difference of the material from the
    mixtures of the measured materials, relative. albedo: RMS variation of the reflectance over
    patches, relative. normals and albedo: None where the surface is too small for patches."""

    normals: float | None
    poses: float
    outside: float
    albedo: float | None

    @classmethod
    def of(cls, fitted: ModelFit) -> ScanQuality:
        """fitted: a joint fit with the baseline's nuisances."""
        normals = albedo = None
        variances = parameter_variances(fitted)
        for place, effect in enumerate(fitted.model.effects):
            if isinstance(effect, SurfaceVariation):
                by_way = dict(zip(WAYS, _over_patches(fitted, place, variances), strict=True))
                normals = float(np.degrees(np.hypot(by_way[TILTS[0]], by_way[TILTS[1]])))
                known = log_albedo_of_patches(fitted.model.effects, effect.patch).mean(axis=1)
                albedo = float(np.hypot(by_way[ALBEDO[0]], known.std()))
        return cls(normals, _poses(fitted, variances), _outside_basis(fitted), albedo)

    def figures(self) -> dict[str, float | None]:
        """By their names in diagnosis.json."""
        return {
            "normals": self.normals,
            "poses": self.poses,
            "outside_basis": self.outside,
            "albedo_variation": self.albedo,
        }

    def sentence(self) -> str:
        """In words, for the user."""
        parts = [] if self.normals is None else [f"normals ± {self.normals:.1f}°"]
        parts += [f"poses ± {self.poses:.1f} px"]
        parts += [f"material {100 * self.outside:.0f} % outside the measured materials"]
        parts += [] if self.albedo is None else [f"albedo varies by {100 * self.albedo:.0f} %"]
        return f"Scan quality: {', '.join(parts)}."


def _over_patches(fitted: ModelFit, place: int, variances: tuple[np.ndarray, ...]) -> np.ndarray:
    """(e,) RMS of the parameters of patches, with the variances of their estimates added."""
    squares = np.square(fitted.model.x[place])
    if len(variances[place]):  # not of patches that are frozen
        squares = squares + variances[place]
    return np.asarray(np.sqrt(squares.reshape(-1, len(WAYS)).mean(axis=0)))


def _poses(fitted: ModelFit, variances: tuple[np.ndarray, ...]) -> float:
    """Pixels along each axis, RMS of estimates with their variances added."""
    model = fitted.model
    place = next(k for k, e in enumerate(model.effects) if isinstance(e, CameraPose))
    shifts = [k for k in range(len(model.x[place])) if k % 3 < 2]  # the third is a rotation
    return float(np.sqrt(np.mean((model.x[place] ** 2 + variances[place])[shifts])))


def _outside_basis(fitted: ModelFit) -> float:
    """RMS of the logarithm of the factor by which the slack of the basis changes the BRDF."""
    model, level = fitted.model, fitted.predicted.mean(axis=1)
    bright = np.flatnonzero(level > BRIGHT * np.percentile(level, 90))
    rows = model.basis_rows(model.lamp_light.state)[bright][:, -COUNT:]
    slack = model.brdfs.coefficients[model.pixels.material[bright]][..., -COUNT:]
    return float(np.sqrt(np.mean(np.einsum("nk,nck->nc", rows, slack) ** 2)))
