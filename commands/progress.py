"""Print the progress of a job on stderr, one line per stage."""

from __future__ import annotations

import sys
import time

from ..core.concurrency.job import Step


class Progress:
    """Call with each Step. Prints when the stage changes, and every 5 seconds within a stage."""

    def __init__(self, share: float = 1.0) -> None:
        self.share = share  # of the whole command that the job takes (0..1)
        self.stage = ""
        self.printed_at = 0.0

    def __call__(self, step: Step) -> None:
        now = time.monotonic()
        if step.stage != self.stage or now - self.printed_at > 5.0:
            print(
                f"[{100 * self.share * step.fraction:3.0f} %] {step.stage}",
                file=sys.stderr,
                flush=True,
            )
            self.stage, self.printed_at = step.stage, now


def print_note(sentence: str) -> None:
    """Print a sentence for the user."""
    print(f"  note: {sentence}")
