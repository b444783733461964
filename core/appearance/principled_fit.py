"""Fit the Principled BSDF to a BRDF, by the metric that predicts what the eye sees.

The metric is the cosine-weighted cube root of Fores, Ferwerda, Gu 2012 ("Toward a perceptually
based metric for BRDF modeling"), the one of several that agreed with observers; a plain L2 fits
the peak and nothing else (Bieron and Peers 2020). Directions count as they do on the MERL grid,
where those studies were made: uniform in sqrt(θh), θd and φd.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..angles import Angles, cosines, light_view
from ..errors import FitError
from .principled import MIN_ROUGHNESS, Configuration, Principled

Array = NDArray[np.floating]

HORIZON = np.radians(82.0)  # light and view farther from the normal than this do not count
# nodes of the quadrature over (θh, θd, φd), θh on a logarithm: a lobe of 1° sees 12 of them
NODES = (44, 12, 8)
COARSE = (44, 6, 4)  # as fine along θh, where lobes are sharp; enough to tell the starts apart
KNEE = np.radians(0.4)
SIMPLER = 1.15  # a pure dielectric or metal may be this much farther off than a mixture
METALLIC, PINNED = 3, 1e-3
COAT_GAIN = 0.9  # a coat must bring the error below this fraction of what goes without it
COAT_FROM = 0.01  # and is not worth having where the error is smaller than this already

# unknowns: base colour (as its square root: even steps in what the eye sees), metallic,
# roughness, specular level, coat weight, coat roughness
LOWER = np.array([0, 0, 0, 0, MIN_ROUGHNESS, 0, 0, MIN_ROUGHNESS])
UPPER = np.array([1, 1, 1, 1, 1, 1, 1, 1.0])


@dataclass(frozen=True)
class PrincipledFit:
    """The Principled nearest to a BRDF, and how near that is.

    error: relative cube-root error, ‖∛(f cosθi) − ∛(ρ cosθi)‖ / ‖∛(ρ cosθi)‖.
    diffuse_error: the same of the best Lambertian, to compare with.
    errors: the error that each start ended with: 'diffuse', 'glossy', 'metal', 'mirror' (those that
        lost on a coarser quadrature), 'coated' where it was tried.
    start: the one that won.
    clipped: True where the BRDF asks for a base colour above 1 and did not get it.
    """

    principled: Principled
    error: float
    diffuse_error: float
    errors: Mapping[str, float]
    start: str
    clipped: bool


def fit_principled(
    evaluate: Callable[[Angles], Array], coat: bool = True, nodes: tuple[int, int, int] = NODES
) -> PrincipledFit:
    """The Principled nearest to ``evaluate(angles) -> (n, 3)``, ρ in 1/sr.

    coat: allow a second lobe where it lowers the error by more than a tenth. A pure dielectric or a
    pure metal is taken where it comes nearly as near as a mixture: no surface is half a metal.
    """
    target, coarse = _Target.of(evaluate, nodes), _Target.of(evaluate, COARSE)
    mean = target.lambertian()
    root = np.sqrt(np.clip(mean, 0.02, 0.95))
    peak = np.sqrt(np.clip(mean / max(mean.max(), 1e-6), 0.02, 0.95))  # a metal: hue alone
    starts = {
        "diffuse": [*root, 0.02, 0.7, 0.3, 0.0, 0.2],
        "glossy": [*root, 0.02, 0.25, 0.5, 0.0, 0.2],
        "metal": [*peak, 0.9, 0.3, 0.5, 0.0, 0.2],
        "mirror": [*peak, 0.5, 0.08, 0.5, 0.0, 0.2],
    }
    found = {name: _descend(coarse, np.array(x), free=6) for name, x in starts.items()}
    best = min(found, key=lambda name: target.error(_principled(found[name])))
    mixed = _descend(target, found[best], free=6)
    found[best] = _purest(target, mixed, free=6)
    if coat and target.error(_principled(found[best])) > COAT_FROM:
        start = mixed.copy()
        start[6:] = 0.5, np.clip(0.4 * start[4], 0.05, 0.6)
        found["coated"] = _purest(target, _descend(target, start, free=8), free=8)
    errors = {name: target.error(_principled(x)) for name, x in found.items()}
    if "coated" in errors and errors["coated"] < COAT_GAIN * errors[best]:
        best = "coated"
    flat = Principled(base_color=np.clip(mean, 0, 1), specular_ior_level=0.0, roughness=1.0)
    return PrincipledFit(
        principled=_principled(found[best]),
        error=errors[best],
        diffuse_error=target.error(flat),
        errors=errors,
        start=best,
        clipped=bool(np.any(found[best][:3] > 0.999)),
    )


@dataclass(frozen=True)
class _Target:
    """What to fit: directions, weights (n, 1) and ∛(ρ cosθi) (n, 3), both times √weight."""

    where: Configuration
    weight: Array
    root: Array

    @classmethod
    def of(cls, evaluate: Callable[[Angles], Array], nodes: tuple[int, int, int]) -> _Target:
        angles, weight = quadrature(nodes)
        light, view = light_view(*angles)
        rho = np.asarray(evaluate(angles), float)
        if rho.shape != (weight.size, 3) or not np.isfinite(rho).all():
            raise FitError(
                f"the BRDF gave {rho.shape} numbers for {weight.size} directions, or some that "
                "are not finite"
            )
        where = Configuration.of(light, view)
        scale = np.sqrt(weight)[:, None]
        return cls(where, scale, scale * np.cbrt(np.maximum(rho, 0) * where.cos_i[:, None]))

    def residual(self, principled: Principled) -> Array:
        f = principled.at(self.where)
        return self.weight * np.cbrt(f * self.where.cos_i[:, None]) - self.root

    def error(self, principled: Principled) -> float:
        length = max(float(np.linalg.norm(self.root)), 1e-12)
        return float(np.linalg.norm(self.residual(principled)) / length)

    def lambertian(self) -> Array:
        """Albedo (3,) of the best diffuse surface: linear in its own cube root."""
        shape = self.weight * np.cbrt(self.where.cos_i / np.pi)[:, None]
        return (np.sum(shape * self.root, axis=0) / np.sum(shape**2)) ** 3


def quadrature(nodes: tuple[int, int, int] = NODES) -> tuple[Angles, Array]:
    """Directions (n,) and weights (n,), Σ = 1 before those beyond the horizon are dropped."""
    n_h, n_d, n_p = nodes
    span = np.log1p(np.pi / 2 / KNEE)
    s = (np.arange(n_h) + 0.5) / n_h
    theta_h = KNEE * np.expm1(s * span)
    # dθh = (θh + knee)·span ds, and the MERL grid has dθh / sqrt(θh) cells there
    density = (theta_h + KNEE) / np.sqrt(theta_h)
    theta_d = (np.arange(n_d) + 0.5) / n_d * np.pi / 2
    phi_d = (np.arange(n_p) + 0.5) / n_p * np.pi
    grid = np.meshgrid(theta_h, theta_d, phi_d, indexing="ij")
    weight = np.broadcast_to(density[:, None, None], nodes) / (density.sum() * n_d * n_p)
    cos_i, cos_o = cosines(*grid)
    seen = np.minimum(cos_i, cos_o) > np.cos(HORIZON)
    return Angles(*(a[seen] for a in grid)), weight[seen]


def _principled(x: Array) -> Principled:
    return Principled(
        base_color=np.clip(x[:3] ** 2, 0, 1),
        metallic=float(x[3]),
        roughness=float(x[4]),
        specular_ior_level=float(x[5]),
        coat_weight=float(x[6]),
        coat_roughness=float(x[7]),
    )


def _descend(target: _Target, start: Array, free: int, metallic: float | None = None) -> Array:
    """Least squares over the first ``free`` unknowns; the others stay as they start, and so does
    metallic where it is given."""
    low, high = LOWER[:free].copy(), UPPER[:free].copy()
    if metallic is not None:
        low[METALLIC] = max(metallic - PINNED, 0.0)
        high[METALLIC] = min(metallic + PINNED, 1.0)

    def residual(x: Array) -> Array:
        return target.residual(_principled(np.concatenate([x, start[free:]]))).ravel()

    margin = np.minimum(1e-3, 0.25 * (high - low))
    inside = np.clip(start[:free], low + margin, high - margin)
    result = least_squares(
        residual, inside, bounds=(low, high), diff_step=1e-4, xtol=1e-5, ftol=1e-6, max_nfev=40
    )
    settled = _settle(result.x)
    if metallic is not None:
        settled[METALLIC] = metallic
    return np.concatenate([settled, start[free:]])


def _purest(target: _Target, mixed: Array, free: int) -> Array:
    """The pure dielectric or metal that is nearly as near as the mixture, else the mixture."""
    within = SIMPLER * target.error(_principled(mixed)) + 1e-4
    for pure in (0.0, 1.0):
        x = _descend(target, mixed, free, metallic=pure)
        if target.error(_principled(x)) < within:
            return x
    return mixed


def _settle(x: Array) -> Array:
    """Numbers a hair from 0 become 0: an artist reads 'metallic 0', not 0.0004."""
    settled = x.copy()
    for i in (3, 5, 6):
        if i < x.size and x[i] < 2e-3:
            settled[i] = 0.0
    return settled
