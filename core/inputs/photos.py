"""The lit photos of a capture as radiance of one unit, whatever files they come from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..calibrate.chart import ChartTone, chart_tone
from ..capture import Capture
from ..errors import InputError, PatinaError
from ..photo import read_encoded
from ..photo.bracket import merge_bracket
from ..photo.exif import Exif, read_exif
from ..photo.noise import estimate_noise
from ..photo.photo import read_photo
from ..photo.transfer import Transfer


@dataclass(frozen=True)
class LitPhoto:
    """radiance: (h, w, 3) float32 linear, divided by its exposure. usable: (h, w) not clipped, in a
    bracket not in all of it. variance: (h, w, 3) of a bracket, else None. notes: how its numbers
    were read, sentences."""

    radiance: NDArray[np.float32]
    usable: NDArray[np.bool_]
    variance: NDArray[np.float32] | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class LitPhotos:
    """How the photos of a capture are read. chart: the tone curve measured, or None; exposures:
    one a file of each photo; first: EXIF's exposure that counts as 1, None where EXIF is not used;
    notes: sentences for the user."""

    capture: Capture
    chart: ChartTone | None
    exposures: tuple[tuple[float, ...], ...]
    first: float | None
    notes: tuple[str, ...]

    @classmethod
    def open(cls, capture: Capture) -> LitPhotos:
        """Measure the chart, read the exposures. Raises InputError."""
        chart = _chart(capture)
        exposures, first, notes = _exposures(capture)
        if chart is not None:
            notes = (*notes, *chart.notes)
        return cls(capture, chart, exposures, first, notes)

    def read(self, place: int) -> LitPhoto:
        """One lit photo. Raises InputError naming the capture's key."""
        return self._read(place)

    def read_with_noise(self, place: int) -> LitPhoto:
        """The same with the variance of every pixel, also where it is no bracket."""
        return self._read(place, noise=True)

    def _read(self, place: int, noise: bool = False) -> LitPhoto:
        photo = self.capture.photos[place]
        try:
            curve = self.curve(place)
            if len(photo.files) == 1:
                one = read_photo(photo.files[0], curve, photo.saturation)
                variance = estimate_noise(one).variance(one.radiance) if noise else None
                radiance = one.radiance
                if self.exposures[place][0] != 1.0:
                    radiance /= np.float32(self.exposures[place][0])
                    if variance is not None:
                        variance /= np.float32(self.exposures[place][0] ** 2)
                told = () if one.info.levels is None else (one.info.sentence,)
                return LitPhoto(radiance, ~one.clipped, variance, (*told, *one.info.notes))
            merged = merge_bracket(
                [partial(read_photo, file, curve, photo.saturation) for file in photo.files],
                self.exposures[place],
                names=[file.name for file in photo.files],
            )
        except InputError as error:
            raise self.capture.error(str(error), "photo", place, "file") from error
        said = (f"{len(photo.files)} exposures merged", *merged.warnings)
        return LitPhoto(merged.radiance, merged.valid, merged.variance, said)

    def read_other(self, file: Path, exposure: float | None = None) -> LitPhoto:
        """A photo of a sphere or a white target, in the same unit. Raises InputError."""
        own = {photo.transfer for photo in self.capture.photos}
        if len(own) > 1:
            raise InputError(
                f"the photos have different transfer curves, which is {file.name}'s? Give one for "
                "all, [tone] transfer"
            )
        photo = read_photo(file, self._curve(own.pop()))
        if exposure is None:
            exposure = self.exposure_of(file)
        return LitPhoto(photo.radiance / np.float32(exposure), ~photo.clipped)

    def check_comparable(self, file: Path) -> None:
        """Refuse a photo whose exposure against the lit ones is not known. Raises InputError."""
        if self.first is not None:
            if read_exif(file).relative_exposure is None:
                raise InputError(
                    f"{file.name} does not say how it was exposed, the lit photos do: give its "
                    "exposure relative to the first of them"
                )
        elif any(e != 1.0 for photo in self.exposures for e in photo):
            raise InputError(f"the lit photos' exposures are given: give that of {file.name} too")

    def exposure_of(self, file: Path) -> float:
        """EXIF's exposure of another photo relative to the first lit one; 1 where it is unknown."""
        own = None if self.first is None else read_exif(file).relative_exposure
        return 1.0 if own is None or self.first is None else own / self.first

    def curve(self, place: int) -> Transfer:
        """The curve a photo is read with; "auto" is what its file says."""
        return self._curve(self.capture.photos[place].transfer)

    def _curve(self, own: str | None) -> Transfer:
        if own is not None:
            return Transfer.named(own)
        if self.chart is not None:
            return self.chart.transfer
        return Transfer.named(self.capture.tone.transfer)


def _chart(capture: Capture) -> ChartTone | None:
    entry = capture.tone.chart
    if entry is None:
        return None
    try:
        return chart_tone(read_encoded(entry.photo), entry.corners, entry.reflectance)
    except PatinaError as error:
        raise capture.error(str(error), "tone", "chart") from error


def _exposures(
    capture: Capture,
) -> tuple[tuple[tuple[float, ...], ...], float | None, tuple[str, ...]]:
    """(exposures of every photo's files, EXIF's exposure that counts as 1, notes).

    What the capture file gives is taken as it is. Where it gives none at all, EXIF is asked: the
    first photo's exposure is 1 and the others are relative to it, so that numbers of the user's (an
    irradiance) keep the unit of that photo's pixels. The two units do not mix.
    """
    given = [photo.exposures is not None for photo in capture.photos]
    asked = [(i, f) for i, p in enumerate(capture.photos) if not given[i] for f in p.files]
    told = {file: read_exif(file) for _, file in asked}
    silent = [(i, f) for i, f in asked if told[f].relative_exposure is None]
    speaking = len(silent) < len(asked)
    if speaking and any(given):
        raise capture.error(
            "the exposure is given here, other photos have EXIF's, which is in another unit: give "
            "all or none",
            "photo", given.index(True), "exposure",
        )  # fmt: skip
    if speaking and silent:
        place, file = silent[0]
        raise capture.error(
            f"{file.name} does not say how it was exposed ({', '.join(told[file].missing)} "
            "missing), other photos do: give the exposure of all",
            "photo", place, "exposure",
        )  # fmt: skip
    if not speaking:
        for place, photo in enumerate(capture.photos):
            if photo.exposures is None and len(photo.files) > 1:
                raise capture.error(
                    "these exposures of one viewpoint do not say how they were exposed: give "
                    "exposure = [...], one a file",
                    "photo", place, "exposure",
                )  # fmt: skip
        return tuple(p.exposures or (1.0,) for p in capture.photos), None, ()
    _check_flash(capture, told)
    first = told[asked[0][1]].relative_exposure or 1.0
    exposures = tuple(
        tuple((told[f].relative_exposure or first) / first for f in p.files) for p in capture.photos
    )
    differ = len({round(e, 3) for photo in exposures for e in photo}) > 1
    notes = (f"exposures are EXIF's, relative to {asked[0][1].name}",) if differ else ()
    return exposures, first, notes


def _check_flash(capture: Capture, told: dict[Path, Exif]) -> None:
    """Refuse to divide a flash's light by shutter times: it does not depend on them."""
    mounted = {light.name for light in capture.lights if light.mounted is not None}
    places = [i for i, photo in enumerate(capture.photos) if photo.light in mounted]
    times = {told[file].exposure_time for i in places for file in capture.photos[i].files}
    if len(times) > 1:
        raise capture.error(
            "these photos' exposure times differ, and a flash's light does not depend on them: "
            "give exposure for all photos (ISO / f-number² for a flash, 1 where these are equal)",
            "photo", places[0], "exposure",
        )  # fmt: skip
