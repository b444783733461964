"""Transfer curves: from the encoded pixel values of a file to linear light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

EXPECTED = 'expected "auto", "srgb", "linear", "bt709", or "gamma:2.2"'
MAX_POINTS = 1 << 16


def srgb_encoded(linear: NDArray[np.floating]) -> NDArray[np.floating]:
    """Linear values 0 … 1 by the transfer curve of IEC 61966-2-1, in their own precision."""
    low = 12.92 * linear
    high = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, low, high).astype(linear.dtype)


@dataclass(frozen=True)
class Parametric:
    """Linear Y of encoded X: (aX + b)^g + e for X ≥ d, else cX + f (ICC.1:2022, 10.18, type 4)."""

    g: float = 1.0
    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 0.0
    e: float = 0.0
    f: float = 0.0

    def __call__(self, encoded: NDArray) -> NDArray[np.float64]:
        x = np.asarray(encoded, np.float64)
        power = np.maximum(self.a * x + self.b, 0.0) ** self.g + self.e
        return np.asarray(np.where(x >= self.d, power, self.c * x + self.f))


@dataclass(frozen=True)
class Sampled:
    """Linear Y of encoded X, interpolated linearly between points and extrapolated beyond them."""

    encoded: tuple[float, ...]
    linear: tuple[float, ...]

    def __call__(self, encoded: NDArray) -> NDArray[np.float64]:
        x, px, py = np.asarray(encoded, np.float64), self.encoded, self.linear
        y = np.interp(x, px, py)
        low = (py[1] - py[0]) / (px[1] - px[0])
        high = (py[-1] - py[-2]) / (px[-1] - px[-2])
        y = np.where(x < px[0], np.maximum(py[0] + low * (x - px[0]), 0.0), y)
        return np.asarray(np.where(x > px[-1], py[-1] + high * (x - px[-1]), y))


Curve = Parametric | Sampled

# IEC 61966-2-1 and ITU-R BT.709, inverted
SRGB = Parametric(2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
BT709 = Parametric(1 / 0.45, 1 / 1.099, 0.099 / 1.099, 1 / 4.5, 0.081)
LINEAR = Parametric(c=1.0)


@dataclass(frozen=True)
class Transfer:
    """A curve for each of R, G, B from the file's encoding (0..1 for integers) to linear light.

    curves: empty only for "auto", the curve that the file itself declares.
    """

    name: str
    curves: tuple[Curve, ...] = ()

    @classmethod
    def named(cls, name: str) -> Transfer:
        """ "auto", "srgb", "linear", "bt709" or "gamma:G". Raises InputError for another name."""
        known = {"srgb": SRGB, "linear": LINEAR, "bt709": BT709}
        if name == "auto":
            return cls("auto")
        if name in known:
            return cls(name, (known[name],) * 3)
        kind, _, number = name.partition(":")
        try:
            gamma = float(number)
        except ValueError:
            gamma = float("nan")
        if kind != "gamma":
            raise InputError(f"there is no transfer curve {name!r}; {EXPECTED}")
        if not 0.1 <= gamma <= 10.0:
            raise InputError(f"{name!r} has no gamma from 0.1 to 10; {EXPECTED}")
        return cls(f"gamma:{gamma:g}", (Parametric(gamma),) * 3)

    @classmethod
    def sampled(cls, encoded: ArrayLike, linear: ArrayLike, name: str = "sampled") -> Transfer:
        """A measured curve. encoded, linear: (n,) points for all channels or (3, n) for R, G, B.

        encoded (0..1 for integer formats) must increase strictly, linear must not decrease; raises
        InputError otherwise. The curve is linear between the points, so give enough of them.
        """
        x, y = (np.asarray(values, np.float64) for values in (encoded, linear))
        if x.shape != y.shape or x.ndim not in (1, 2) or (x.ndim == 2 and len(x) != 3):
            raise InputError(
                f"the sampled transfer curve has encoded values of shape {x.shape} and linear "
                f"values of shape {y.shape}; expected the same shape, (n,) or (3, n)"
            )
        x, y = np.broadcast_to(x, (3, x.shape[-1])), np.broadcast_to(y, (3, y.shape[-1]))
        if not 2 <= x.shape[1] <= MAX_POINTS or not np.isfinite([x, y]).all():
            raise InputError(
                "the sampled transfer curve has too few or too many points, or points that are not "
                "finite; expected 2 to 65536 finite points"
            )
        if (np.diff(x) <= 0).any() or (np.diff(y) < 0).any() or (y[:, -1] <= y[:, 0]).any():
            raise InputError(
                "the sampled transfer curve does not increase from its first to its last point; "
                "expected encoded values that increase and linear values that never decrease"
            )
        red, green, blue = (
            Sampled(tuple(a.tolist()), tuple(b.tolist())) for a, b in zip(x, y, strict=True)
        )
        return cls(name, (red, green, blue))

    @property
    def is_linear(self) -> bool:
        """True where encoded values are linear light already."""
        return bool(self.curves) and all(curve == LINEAR for curve in self.curves)

    def decode(self, encoded: NDArray) -> NDArray[np.float32]:
        """(…, 3) encoded values → (…, 3) linear light. Raises ValueError for "auto"."""
        pixels = np.asarray(encoded)
        out = np.empty(pixels.shape, np.float32)
        for channel, curve in enumerate(self._known()):
            out[..., channel] = curve(pixels[..., channel])
        return out

    def table(self, levels: int) -> NDArray[np.float32]:
        """(levels, 3) linear light of each code 0 … levels − 1 of an integer format. Raises
        ValueError for "auto"."""
        codes = np.arange(levels) / (levels - 1)
        return np.stack([curve(codes) for curve in self._known()], axis=1).astype(np.float32)

    def _known(self) -> tuple[Curve, ...]:
        if not self.curves:
            raise ValueError('"auto" has no curve of its own: read_photo finds the file\'s')
        return self.curves


def same_curve(one: Curve, other: Curve, tolerance: float = 2e-3) -> bool:
    """Whether two curves agree within ``tolerance`` over 0..1."""
    x = np.linspace(0, 1, 257)
    return bool(np.abs(one(x) - other(x)).max() < tolerance)


def is_increasing(curve: Curve) -> bool:
    """Whether a curve of a profile is usable for a photo: finite and never decreasing over 0..1."""
    with np.errstate(all="ignore"):
        y = curve(np.linspace(0, 1, 1025))
    return bool(np.isfinite(y).all() and y[-1] > y[0] and (np.diff(y) > -1e-6).all())
