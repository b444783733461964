"""The arguments of commands that fit a capture."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser, out: str) -> None:
    """The capture, where to write (``out``: what), and on how many threads."""
    parser.add_argument("capture", type=Path, help="the capture file (*.capture.toml)")
    parser.add_argument("--out", type=Path, required=True, help=f"folder for {out}")
    parser.add_argument(
        "--threads", type=int, metavar="N", help="look at the photos on N threads (default: cores)"
    )
