"""A BSDF for Mitsuba 3: a measured, isotropic BRDF from Patina's NAME_mitsuba.npz.

    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")          # or scalar_rgb, cuda_ad_rgb
    import patina_bsdf                     # registers the plugin "patina"
    scene = mi.load_file("NAME.xml")

In a scene: <bsdf type="patina"><string name="filename" value="NAME_mitsuba.npz"/></bsdf>; put it
into <bsdf type="twosided"> for surfaces seen from both sides. RGB variants only.

The file holds ln(rho * cosMap + epsilon) at nodes over the half/difference angles. It is
interpolated linearly, then rho = (exp(.) - epsilon)/cosMap, cosMap = clip(cos_i * cos_o, 0.01, 1):
the same numbers as in Patina. Directions are drawn from a GGX lobe mixed with a cosine lobe.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np


class PatinaBSDF(mi.BSDF):
    """Properties: filename (the .npz, looked for beside the scene), scale (1)."""

    def __init__(self, props: Any) -> None:
        mi.BSDF.__init__(self, props)
        if mi.is_spectral or mi.is_polarized:
            raise RuntimeError('patina: use an RGB variant of Mitsuba, such as "llvm_ad_rgb"')
        self.file = _resolved(props["filename"])
        self.scale = float(props.get("scale", 1.0))
        with np.load(self.file, allow_pickle=False) as data:
            table = np.asarray(data["log_table"], np.float32)
            self.knee = float(data["knee"])
            self.epsilon = float(data["epsilon"])
            self.alpha = float(data["sampling_alpha"])
            self.share = float(data["sampling_share"])
        # phi_d is periodic: its first node is repeated behind the last one
        table = np.concatenate([table, table[:, :, :1]], axis=2)
        self.nodes = table.shape[:3]
        self.lookup = _Lookup(table)
        flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
        self.m_components = [flags]
        self.m_flags = flags

    def _rho(self, wi: Any, wo: Any, active: Any) -> Any:
        """rho (RGB, 1/sr) of two directions in the local frame, both above the surface."""
        half, apart = wi + wo, wi - wo
        size = dr.norm(half)
        sin_h = dr.hypot(half.x, half.y)
        theta_h = dr.atan2(sin_h, half.z)
        theta_d = dr.atan2(dr.norm(apart), size)
        # n . (v x l) and H (n.v - n.l)/2, with light wo and view wi
        phi = dr.atan2(wi.x * wo.y - wi.y * wo.x, 0.5 * size * (wi.z - wo.z))
        phi = dr.select(phi < 0, phi + dr.pi, phi)
        phi = dr.select(sin_h > 1e-6 * size, phi, 0.5 * dr.pi)
        n_h, n_d, n_p = self.nodes
        span = float(np.log1p(0.5 * np.pi / self.knee))
        u = mi.Point3f(
            dr.clip(phi / dr.pi, 0, 1) * (n_p - 1),
            dr.clip(theta_d / (0.5 * dr.pi), 0, 1) * (n_d - 1),
            dr.clip(dr.log(1 + theta_h / self.knee) / span, 0, 1) * (n_h - 1),
        )
        logs = self.lookup(u, active)
        weight = dr.clip(wi.z * wo.z, 0.01, 1.0)
        return dr.maximum(dr.exp(logs) - self.epsilon, 0.0) * (self.scale / weight)

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """rho * cos(theta_o)."""
        active = active & (si.wi.z > 0) & (wo.z > 0)
        if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection):
            return mi.Color3f(0)
        return dr.select(active, self._rho(si.wi, wo, active) * wo.z, mi.Color3f(0))

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """Density of the directions that sample() draws."""
        active = active & (si.wi.z > 0) & (wo.z > 0)
        half = dr.normalize(si.wi + wo)
        lobe = self._lobe()
        glossy = lobe.pdf(si.wi, half) / (4 * dr.maximum(dr.dot(wo, half), 1e-6))
        diffuse = mi.warp.square_to_cosine_hemisphere_pdf(wo)
        return dr.select(active, self.share * glossy + (1 - self.share) * diffuse, 0)

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
        """A direction from the lobe or from the cosine, and rho * cos / density."""
        active = active & (si.wi.z > 0)
        normal, _ = self._lobe().sample(si.wi, sample2)
        glossy = mi.reflect(si.wi, normal)
        diffuse = mi.warp.square_to_cosine_hemisphere(sample2)
        found = mi.BSDFSample3f()
        found.wo = dr.select(sample1 < self.share, glossy, diffuse)
        found.pdf = self.pdf(ctx, si, found.wo, active)
        found.eta = 1.0
        found.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        found.sampled_component = mi.UInt32(0)
        active = active & (found.pdf > 0) & (found.wo.z > 0)
        value = self.eval(ctx, si, found.wo, active) / dr.select(active, found.pdf, 1.0)
        return found, dr.select(active, value, mi.Color3f(0))

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """Both at once."""
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def _lobe(self) -> Any:
        return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, True)

    def traverse(self, callback: Any) -> None:
        """Nothing to change."""

    def to_string(self) -> str:
        return f"PatinaBSDF[{self.file}]"


class _Lookup:
    """Trilinear lookup in a table (n_h, n_d, n_p, 3) at fractional nodes (p, d, h)."""

    def __init__(self, table: Any) -> None:
        self.shape = table.shape[:3]
        self.flat = None
        if dr.is_jit_v(mi.Float):
            self.texture = mi.Texture3f(
                mi.TensorXf(table), use_accel=False, wrap_mode=dr.WrapMode.Clamp
            )
        else:
            self.flat = table.reshape(-1, 3).astype(float)
            _, n_d, n_p = self.shape
            steps = [(h * n_d + d) * n_p + p for h in (0, 1) for d in (0, 1) for p in (0, 1)]
            self.corners = np.array(steps)

    def __call__(self, u: Any, active: Any) -> Any:
        n_h, n_d, n_p = self.shape
        if self.flat is None:
            size = mi.Point3f(n_p, n_d, n_h)
            return mi.Color3f(*self.texture.eval((u + 0.5) / size, active))
        p, d, h = (min(int(u[i]), n - 2) for i, n in enumerate((n_p, n_d, n_h)))
        a, b, c = float(u[0]) - p, float(u[1]) - d, float(u[2]) - h
        start = (h * n_d + d) * n_p + p
        near, far = (1 - c) * (1 - b), (1 - c) * b
        above, beyond = c * (1 - b), c * b
        weight = [near * (1 - a), near * a, far * (1 - a), far * a,
                  above * (1 - a), above * a, beyond * (1 - a), beyond * a]  # fmt: skip
        return mi.Color3f(*(weight @ self.flat[self.corners + start]))


def _resolved(name: str) -> str:
    """The file, looked for where Mitsuba looks for a scene's files."""
    if Path(name).is_file():
        return name
    finder = mi.file_resolver() if hasattr(mi, "file_resolver") else None
    if finder is None:
        finder = mi.Thread.thread().file_resolver()
    return str(finder.resolve(name))


mi.register_bsdf("patina", PatinaBSDF)
