"""``build-basis NBRDF.npz``: compute the embedded basis again (for developers)."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.basis import storage
from ..core.basis.build_default import build, write_checksums
from ..core.basis.default_basis import DEFAULT_FILE
from ..core.basis.merl_folder import CHECKSUMS_FILE
from ..core.concurrency.job import Step
from .progress import Progress

HELP = "compute the embedded basis again from neural encodings (for developers)"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("encodings", type=Path, help="the neural encodings, nbrdf_merl.npz")
    parser.add_argument(
        "--others",
        type=Path,
        help="encodings of materials that are not in MERL, nbrdf_validation.npz: the prior of a "
        "fit is learnt from them too",
    )
    parser.add_argument(
        "--checksums", type=Path, help="merl_sha256.csv; also write the embedded checksums"
    )
    parser.add_argument("--out", type=Path, default=DEFAULT_FILE, help="the .npz file to write")


def run(arguments: argparse.Namespace) -> None:
    progress = Progress()
    basis = build(
        arguments.encodings,
        progress=lambda stage, done: progress(Step(stage, done)),
        others=arguments.others,
    )
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    storage.save(arguments.out, basis)
    size = arguments.out.stat().st_size
    print(
        f"wrote {arguments.out}: {size / 1e6:.2f} MB, version {storage.load(arguments.out).version}"
    )
    if arguments.checksums is not None:
        count = write_checksums(arguments.checksums, CHECKSUMS_FILE)
        print(f"wrote {CHECKSUMS_FILE}: {count} files")
