"""The interface of consumers of samples, which arrive in pieces of a photo."""

from __future__ import annotations

from typing import Protocol

from .table import SampleTable


class SampleSink(Protocol):
    """Consumes the samples of one material. They arrive in the order of photos and rows, in pieces
    of any size, each of one photo. The caller does not keep a piece."""

    def add(self, photo: int, table: SampleTable) -> None:
        """Samples of a piece of a photo; table.photo holds its index. Arrays may be read-only."""
