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
from ..photo.exif import read_exif
from ..photo.photo import read_photo
from ..photo.transfer import Transfer


@dataclass(frozen=True)
class LitPhoto:
    """radiance: (h, w, 3) float32 linear, divided by its exposure. usable: (h, w) neither clipped
    nor, of a bracket, lost in noise. variance: (h, w, 3) of a bracket, else None. notes: how its
    numbers were read, sentences."""

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
        photo = self.capture.photos[place]
        try:
            curve = self.curve(place)
            if len(photo.files) == 1:
                one = read_photo(photo.files[0], curve, photo.saturation)
                radiance = one.radiance
                if self.exposures[place][0] != 1.0:
                    radiance = radiance / np.float32(self.exposures[place][0])
                told = () if one.info.levels is None else (one.info.sentence,)
                return LitPhoto(radiance, ~one.clipped, notes=(*told, *one.info.notes))
            merged = merge_bracket(
                [partial(read_photo, file, curve, photo.saturation) for file in photo.files],
                self.exposures[place],
                names=[file.name for file in photo.files],
            )
        except InputError as error:
            raise self.capture.error(str(error), "photo", place, "file") from error
        return LitPhoto(merged.radiance, merged.valid, merged.variance, merged.warnings)

    def read_other(self, file: Path, exposure: float | None = None) -> LitPhoto:
        """A photo of a sphere or a white target, in the same unit. Raises InputError."""
        photo = read_photo(file, self._curve(None))
        if exposure is None:
            exposure = self.exposure_of(file)
        return LitPhoto(photo.radiance / np.float32(exposure), ~photo.clipped)

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

    What the capture file gives is taken as it is. Where it gives none, EXIF is asked: the first
    photo's exposure is 1 and the others are relative to it, so that numbers of the user's (an
    irradiance) keep the unit of that photo's pixels.
    """
    asked = [file for photo in capture.photos if photo.exposures is None for file in photo.files]
    told = {file: read_exif(file).relative_exposure for file in asked}
    silent = [file for file in asked if told[file] is None]
    notes: tuple[str, ...] = ()
    if silent and len(silent) < len(asked):
        place = next(i for i, p in enumerate(capture.photos) if silent[0] in p.files)
        raise capture.error(
            f"{silent[0].name} does not say how it was exposed, other photos do: give its exposure",
            "photo", place, "exposure",
        )  # fmt: skip
    first = None if silent or not asked else told[asked[0]]
    if first is not None and len({round(told[file] / first, 3) for file in asked}) > 1:  # type: ignore[operator]
        notes = (f"exposures are EXIF's, relative to {asked[0].name}",)
    exposures = []
    for place, photo in enumerate(capture.photos):
        if photo.exposures is not None:
            exposures.append(photo.exposures)
            continue
        if first is None and len(photo.files) > 1:
            raise capture.error(
                "these exposures of one viewpoint do not say how they were exposed: give exposure "
                "= [...], one a file",
                "photo", place, "exposure",
            )  # fmt: skip
        exposures.append(tuple((told[f] or 1.0) / (first or 1.0) for f in photo.files))
    return tuple(exposures), first, notes
