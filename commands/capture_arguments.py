"""Arguments shared by the commands that fit a capture."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser, out: str) -> None:
    """Add the capture, the output folder and the number of threads.

    out: what is written, as the help text names it.
    """
    parser.add_argument("capture", type=Path, help="the capture file (*.capture.toml)")
    parser.add_argument("--out", type=Path, required=True, help=f"folder for {out}")
    add_threads(parser)


def add_threads(parser: argparse.ArgumentParser) -> None:
    """Add the number of threads."""
    parser.add_argument(
        "--threads", type=int, metavar="N",
        help="process the photos on N threads (default: one per core, at most four)",
    )  # fmt: skip
