"""The remaining time of a job, from the fraction that is done."""

from __future__ import annotations

MIN_FRACTION, MIN_SECONDS = 0.03, 2.0  # done and elapsed before the time is estimated
FLOOR = 0.25  # of the extrapolated time: less is never stated while the fraction stands still


class RemainingTime:
    """Estimates the remaining time of one job.

    The elapsed time is extrapolated whenever the fraction grows. While it stands still, in a long
    piece of work, the estimate counts down: an extrapolation would grow with every second.
    """

    def __init__(self) -> None:
        self._fraction = self._left = self._at = 0.0

    def update(self, elapsed: float, fraction: float) -> float | None:
        """Remaining seconds; None if it is too early to say.

        elapsed: seconds since the start; fraction: of the whole job, 0–1.
        """
        if fraction <= 0:
            return None
        extrapolated = elapsed * (1 - fraction) / fraction
        if fraction > self._fraction:
            self._fraction, self._left, self._at = fraction, extrapolated, elapsed
        if fraction < MIN_FRACTION or elapsed < MIN_SECONDS:
            return None
        return max(self._left - (elapsed - self._at), FLOOR * extrapolated)
