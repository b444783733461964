"""Progress of a job on stderr: one line a stage."""

from __future__ import annotations

import sys
import time

from ..core.concurrency.job import Step


class Progress:
    """Call with each Step; prints when the stage changes, and every few seconds within one."""

    def __init__(self, share: float = 1.0) -> None:
        self.share = share  # of the whole command that the job's own fraction speaks of
        self.stage = ""
        self.spoken = 0.0

    def __call__(self, step: Step) -> None:
        now = time.monotonic()
        if step.stage != self.stage or now - self.spoken > 5.0:
            print(
                f"[{100 * self.share * step.fraction:3.0f} %] {step.stage}",
                file=sys.stderr,
                flush=True,
            )
            self.stage, self.spoken = step.stage, now
