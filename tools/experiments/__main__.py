"""`run.py experiments [NAME ...]`: run the experiments, and write their tables and figures to
docs/method/experiments.md and docs/method/appearance.md."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import time
from types import ModuleType

from ..common import say
from ..package import load_patina

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
NAMES = (
    "check",
    "ablation",
    "sweeps",
    "goals",
    "goniometer",
    "clipped",
    "proposed_photo",
    "appearance",
)


def main() -> int:
    """Run the named experiments, or all, then write the documents; return the exit code."""
    parser = argparse.ArgumentParser(prog="run.py experiments", description=__doc__)
    parser.add_argument(
        "names",
        nargs="*",
        metavar="NAME",
        help=f"experiments to run: {', '.join(NAMES)} (default: all)",
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help="run a few cases, in less than three minutes; write no document",
    )
    parser.add_argument(
        "--render", action="store_true", help="write the documents from stored results; run nothing"
    )
    parser.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1), metavar="N")
    parser.add_argument(
        "--only", nargs="+", metavar="ESTIMATOR",
        help='run only these estimators ("ours", "paper" ...), and keep other results',
    )  # fmt: skip
    parser.add_argument(
        "--scenes", nargs="+", metavar="SCENE", help="run only these scenes, and keep other results"
    )
    arguments = parser.parse_args()
    unknown = [name for name in arguments.names if name not in NAMES]
    if unknown:
        parser.error(f"found {unknown[0]!r}, expected one of {', '.join(NAMES)}")
    for (
        key
    ) in THREADS:  # one thread per process; numpy reads these when it is imported, also in children
        os.environ.setdefault(key, "1")
    load_patina()
    from . import document, materials, store
    from .runs import Records, merged, run_all

    if not arguments.render:
        if not materials.data_folder().is_dir():
            say("experiments: found no reference data; expected it in ../shared/data")
            return 2
        materials.training_set()  # computed before the worker processes need it
        for name in arguments.names or NAMES:
            module = _module(name)
            start = time.perf_counter()
            old = store.load(name, arguments.quick) or []

            def keep(records: Records, name: str = name, old: Records = old) -> None:
                store.save(name, merged(old, records, arguments.only, ended=False), arguments.quick)

            tasks = module.tasks(arguments.quick)
            if arguments.scenes:
                tasks = [t for t in tasks if not set(arguments.scenes).isdisjoint(map(str, t))]
            records = run_all(name, module.work, tasks, arguments.workers, arguments.only, keep)
            all_made = merged(old, records, arguments.only, ended=not arguments.scenes)
            store.save(name, all_made, arguments.quick)
            say(f"{name}: {len(records)} records, {time.perf_counter() - start:.0f} s")
    if arguments.quick:
        print(document.summary())
    else:
        document.write(arguments.names or NAMES)
    return 0


def _module(name: str) -> ModuleType:
    return importlib.import_module(f".{name}", __package__)


if __name__ == "__main__":
    sys.exit(main())
