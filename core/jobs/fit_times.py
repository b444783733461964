"""How the time of a fit divides into its stages, so that progress is proportional to time.

The seconds were measured on two cores with the demo (8 photos of 0.2 megapixels, 247,000 and 27,000
samples) and a scanned bunny (8 of 0.7 megapixels, 378,000 samples). Only their ratios matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

READING = 0.5  # scan and rays
SAMPLING_PER_PHOTO, SAMPLING_PER_MEGAPIXEL = 0.12, 0.15
FIT, FIT_PER_SAMPLE = 2.2, 2.8e-5  # of one material
PORTABLE = 4.7  # approximations for other renderers, of one material
ASSIGNING = 0.1
SAMPLES_PER_PIXEL = 0.2  # of all photos; before the samples are known
MAX_SAMPLES = 500_000  # that a material is fitted to


def fit_seconds(samples: int) -> float:
    """Seconds of the fit of one material, without its approximations for other renderers."""
    return FIT + FIT_PER_SAMPLE * min(samples, MAX_SAMPLES)


@dataclass(frozen=True)
class FitTimes:
    """Expected seconds of the stages. fits: of each material; portable: of each material, 0 where
    no portable forms are fitted."""

    sampling: float
    fits: tuple[float, ...]
    portable: float

    @classmethod
    def before_sampling(cls, photos: int, pixels: int, materials: int, portable: bool) -> FitTimes:
        """photos: their number; pixels: of all photos together; materials: their number."""
        each = int(SAMPLES_PER_PIXEL * pixels / materials)
        return cls.of(photos, pixels, [each] * materials, portable)

    @classmethod
    def of(cls, photos: int, pixels: int, samples: Sequence[int], portable: bool) -> FitTimes:
        """photos: their number; pixels: of all photos together; samples: of each material."""
        return cls(
            SAMPLING_PER_PHOTO * photos + SAMPLING_PER_MEGAPIXEL * pixels / 1e6,
            tuple(fit_seconds(count) for count in samples),
            PORTABLE if portable else 0.0,
        )

    @property
    def total(self) -> float:
        """Seconds of the whole fit."""
        materials = sum(self.fits) + self.portable * len(self.fits)
        return READING + self.sampling + materials + ASSIGNING

    @property
    def read(self) -> float:
        """Fraction of the job that is done when the scan is read."""
        return READING / self.total

    @property
    def sampled(self) -> float:
        """Fraction of the job that is done when the samples are taken."""
        return (READING + self.sampling) / self.total

    def material(self, index: int) -> tuple[float, float]:
        """(fraction at its start, fraction that it takes) of one material."""
        earlier = sum(self.fits[:index]) + self.portable * index
        own = self.fits[index] + self.portable
        return self.sampled + earlier / self.total, own / self.total

    def fit_share(self, index: int) -> float:
        """Fraction of a material's time that its fit takes."""
        return self.fits[index] / (self.fits[index] + self.portable)
