"""Transfer curves: what a file's numbers mean in linear light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

EXPECTED = 'expected "auto", "srgb", "linear", "bt709", or "gamma:2.2"'
MOST_POINTS = 1 << 16


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
    """Linear Y of encoded X through points, straight between them and on beyond the ends."""

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

    ``curves`` is empty only for "auto": what the file itself says.
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
            raise InputError(f"no transfer curve is called {name!r}; {EXPECTED}")
        if not 0.1 <= gamma <= 10.0:
            raise InputError(f"{name!r} needs a number from 0.1 to 10; {EXPECTED}")
        return cls(f"gamma:{gamma:g}", (Parametric(gamma),) * 3)

    @classmethod
    def sampled(cls, encoded: ArrayLike, linear: ArrayLike, name: str = "sampled") -> Transfer:
        """From calibration: points (n,) for all channels or (3, n) for R, G, B.

        ``encoded`` (0..1 for integer formats) must rise, ``linear`` must not fall; raises
        InputError otherwise. Straight lines join the points: give enough of them.
        """
        x, y = (np.asarray(values, np.float64) for values in (encoded, linear))
        if x.shape != y.shape or x.ndim not in (1, 2) or (x.ndim == 2 and len(x) != 3):
            raise InputError(
                "a sampled transfer curve needs as many encoded as linear numbers, "
                f"(n,) or (3, n); found {x.shape} and {y.shape}"
            )
        x, y = np.broadcast_to(x, (3, x.shape[-1])), np.broadcast_to(y, (3, y.shape[-1]))
        if not 2 <= x.shape[1] <= MOST_POINTS or not np.isfinite([x, y]).all():
            raise InputError("a sampled transfer curve needs 2 to 65536 points, all finite")
        if (np.diff(x) <= 0).any() or (np.diff(y) < 0).any() or (y[:, -1] <= y[:, 0]).any():
            raise InputError("a sampled transfer curve must rise from its first to its last point")
        red, green, blue = (
            Sampled(tuple(a.tolist()), tuple(b.tolist())) for a, b in zip(x, y, strict=True)
        )
        return cls(name, (red, green, blue))

    @property
    def is_linear(self) -> bool:
        """Whether nothing needs to be done."""
        return bool(self.curves) and all(curve == LINEAR for curve in self.curves)

    def decode(self, encoded: NDArray) -> NDArray[np.float32]:
        """(…, 3) encoded → (…, 3) linear."""
        pixels = np.asarray(encoded)
        out = np.empty(pixels.shape, np.float32)
        for channel, curve in enumerate(self._known()):
            out[..., channel] = curve(pixels[..., channel])
        return out

    def table(self, levels: int) -> NDArray[np.float32]:
        """(levels, 3) linear light of each code 0 … levels − 1 of an integer format."""
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


def rises(curve: Curve) -> bool:
    """Whether a curve of a profile can be one of a photo: finite, never falling over 0..1."""
    with np.errstate(all="ignore"):
        y = curve(np.linspace(0, 1, 1025))
    return bool(np.isfinite(y).all() and y[-1] > y[0] and (np.diff(y) > -1e-6).all())
