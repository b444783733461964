"""A lobe stack as a vector of unknowns, its reflectance and its derivatives.

Unknowns: square root of the diffuse albedo facing the viewer, midway and at the edge (9), diffuse
roughness, then for each lobe √f90 (3), √(f0/f90) facing, midway and at the edge (9), and the
roughness. All lie in [0, 1], steps are perceptually even, and f0 ≤ f90 ≤ 1 needs no further
constraint. A plain stack has fewer unknowns: the three values of a colour are one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .layered_model import Configuration
from .lobe_stack import Lobe, LobeStack, albedo_fit, blending
from .oren_nayar import oren_nayar
from .principled import MIN_ROUGHNESS

Array = NDArray[np.floating]

BASE, EACH = 10, 13  # number of unknowns of the diffuse base, and of a lobe
PLAIN_BASE, PLAIN_EACH = 4, 7  # the same of a plain stack
STEP = 1e-4  # of the finite differences by roughness and diffuse colour


def bounds(lobes: int) -> tuple[Array, Array]:
    """(lower, upper) bounds of the unknowns of a stack with this many lobes."""
    low, high = np.zeros(BASE + EACH * lobes), np.ones(BASE + EACH * lobes)
    low[BASE + EACH - 1 :: EACH] = MIN_ROUGHNESS
    return low, high


def tied(lobes: int) -> NDArray[np.intp]:
    """(unknowns,) index of each into the reduced unknowns of a plain stack: diffuse (3), its
    roughness, then for each lobe √f90 (3), √(f0/f90) (3), roughness."""
    base = [0, 1, 2] * 3 + [3]
    lobe = [0, 1, 2] + [3, 4, 5] * 3 + [6]
    return np.array(base + [PLAIN_BASE + PLAIN_EACH * k + i for k in range(lobes) for i in lobe])


def stack_of(x: Array) -> LobeStack:
    """The stack with these unknowns; a colour whose three values agree is stored as one."""
    facing, mid, edge = x[:9].reshape(3, 3) ** 2
    return LobeStack(
        diffuse=facing,
        diffuse_roughness=float(x[9]),
        lobes=tuple(_lobe(p) for p in x[BASE:].reshape(-1, EACH)),
        diffuse_mid=None if np.array_equal(facing, mid) else mid,
        diffuse_edge=None if np.array_equal(facing, edge) else edge,
    )


def reflectance_and_derivatives(x: Array, where: Configuration) -> tuple[Array, Array]:
    """f (n, 3) in 1/sr and df/dx (unknowns, n, 3), for directions above the horizon."""
    stack = stack_of(x)
    shares = blending(where.cos_o)
    schlick = np.clip(1 - where.cos_d, 0, 1) ** Lobe.exponent
    colour = sum(s[:, None] * v**2 for s, v in zip(shares, x[:9].reshape(3, 3), strict=True))
    base = _diffuse(colour, x[9], where)
    derivatives = np.zeros((len(x), *base.shape))
    shapes = [where.ggx(lobe.roughness) for lobe in stack.lobes]
    own = [
        g[:, None] * lobe.fresnel(where.cos_d, where.cos_o)
        for g, lobe in zip(shapes, stack.lobes, strict=True)
    ]
    transmission = [lobe.transmission(where.cos_o) for lobe in stack.lobes]
    # below[k]: the reflectance of lobe k and all below, without what lies above
    below: list[Array] = [base]
    for reflected, part in zip(reversed(own), reversed(transmission), strict=True):
        below.insert(0, np.asarray(reflected + part[:, None] * below[0], np.float64))
    above = np.ones(len(base))
    for k, lobe in enumerate(stack.lobes):
        start = BASE + EACH * k
        u, a = x[start : start + 3], x[start + 3 : start + 12].reshape(3, 3)
        at_0, at_90 = albedo_fit(where.cos_o, lobe.roughness**2)
        ratio = sum(s[:, None] * v**2 for s, v in zip(shares, a, strict=True))
        brightest = np.argmax(u**2 * (ratio * at_0[:, None] + at_90[:, None]), axis=1)
        rest = np.where(transmission[k] > 0, above, 0.0)[:, None] * below[k + 1]
        shape, flat = above * shapes[k], 1 - schlick
        for c in range(3):
            decides = (brightest == c)[:, None] * rest
            derivatives[start + c, :, c] += 2 * u[c] * shape * (ratio[:, c] * flat + schlick)
            derivatives[start + c] -= 2 * u[c] * (ratio[:, c] * at_0 + at_90)[:, None] * decides
            for j, share in enumerate(shares):
                slope = 2 * a[j, c] * u[c] ** 2 * share
                derivatives[start + 3 + 3 * j + c, :, c] += slope * shape * flat
                derivatives[start + 3 + 3 * j + c] -= (slope * at_0)[:, None] * decides
        h = STEP if lobe.roughness < 0.5 else -STEP
        moved = Lobe(lobe.f0, lobe.f90, lobe.roughness + h, lobe.f0_mid, lobe.f0_edge)
        reflected = where.ggx(moved.roughness)[:, None] * moved.fresnel(where.cos_d, where.cos_o)
        change = reflected + moved.transmission(where.cos_o)[:, None] * below[k + 1] - below[k]
        derivatives[start + 12] = above[:, None] * change / h
        above = above * transmission[k]
    step = np.where(colour < 0.5, STEP, -STEP)
    by_colour = above[:, None] * (_diffuse(colour + step, x[9], where) - base) / step
    for j, share in enumerate(shares):
        for c in range(3):
            derivatives[3 * j + c, :, c] = 2 * x[3 * j + c] * share * by_colour[:, c]
    h = STEP if x[9] < 0.5 else -STEP
    derivatives[9] = above[:, None] * (_diffuse(colour, x[9] + h, where) - base) / h
    return below[0], derivatives


def _lobe(p: Array) -> Lobe:
    """The lobe with unknowns p (EACH,)."""
    f90 = p[:3] ** 2
    facing, mid, edge = f90 * p[3:12].reshape(3, 3) ** 2
    return Lobe(
        f0=facing,
        f90=f90,
        roughness=float(p[12]),
        f0_mid=None if np.array_equal(facing, mid) else mid,
        f0_edge=None if np.array_equal(facing, edge) else edge,
    )


def _diffuse(color: Array, roughness: float, where: Configuration) -> Array:
    """f (n, 3) in 1/sr of the diffuse base alone."""
    return oren_nayar(color, roughness, where.cos_i, where.cos_o, where.cos_io)
