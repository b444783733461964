"""`run.py experiments [NAME ...]`: tables of docs/method/experiments.md and appearance.md, measured
and drawn again."""

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
NAMES = ("check", "ablation", "sweeps", "goals", "appearance")


def main() -> int:
    """Run the named experiments, or all, then write the document; returns the exit code."""
    parser = argparse.ArgumentParser(prog="run.py experiments", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(NAMES)}")
    parser.add_argument(
        "--quick", action="store_true", help="a few cases, below three minutes; no document"
    )
    parser.add_argument(
        "--render", action="store_true", help="write the document from results already there"
    )
    parser.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1), metavar="N")
    parser.add_argument(
        "--only", nargs="+", metavar="ESTIMATOR",
        help='run these estimators alone ("ours", "paper" ...), keep the other results',
    )  # fmt: skip
    parser.add_argument(
        "--scenes", nargs="+", metavar="SCENE", help="these scenes alone, keep the other results"
    )
    told = parser.parse_args()
    unknown = [name for name in told.names if name not in NAMES]
    if unknown:
        parser.error(f"no experiment is called {unknown[0]!r}; there are {', '.join(NAMES)}")
    for key in THREADS:  # one thread a process; read when numpy loads, here and in the children
        os.environ.setdefault(key, "1")
    load_patina()
    from . import document, materials, store
    from .runs import Records, merged, run_all

    if not told.render:
        if not materials.data_folder().is_dir():
            say("experiments: the reference data is not here (data/ of ../shared)")
            return 2
        materials.training_set()  # once, before processes share it
        for name in told.names or NAMES:
            module = _module(name)
            since = time.perf_counter()
            old = store.load(name, told.quick) or []

            def keep(records: Records, name: str = name, old: Records = old) -> None:
                store.save(name, merged(old, records, told.only, ended=False), told.quick)

            tasks = module.tasks(told.quick)
            if told.scenes:
                tasks = [t for t in tasks if not set(told.scenes).isdisjoint(map(str, t))]
            records = run_all(name, module.work, tasks, told.workers, told.only, keep)
            all_made = merged(old, records, told.only, ended=not told.scenes)
            store.save(name, all_made, told.quick)
            say(f"{name}: {len(records)} records, {time.perf_counter() - since:.0f} s")
    if told.quick:
        print(document.summary())
    else:
        document.write(told.names or NAMES)
    return 0


def _module(name: str) -> ModuleType:
    return importlib.import_module(f".{name}", __package__)


if __name__ == "__main__":
    sys.exit(main())
