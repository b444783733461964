"""Who wants the samples as they are taken, a piece of a photo at a time."""

from __future__ import annotations

from typing import Protocol

from .table import SampleTable


class SampleSink(Protocol):
    """Takes the samples of one material. They come in the order of photos and rows, in pieces of
    any size, each of one photo; a piece is not kept by anybody else."""

    def add(self, photo: int, table: SampleTable) -> None:
        """Samples of a photo's piece; table.photo holds its number. Arrays may be read-only."""
