"""Patina without a window.

blender -b --python-exit-code 1 -P headless.py -- COMMAND …
python headless.py COMMAND …                            (with the bpy wheel)

Inside a Blender that has the extension enabled, that extension runs; otherwise the files beside
this one do, as package "patina".
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import signal
import sys
from pathlib import Path
from typing import NoReturn

COMMANDS = {
    "fit": "fit",
    "diagnose": "diagnose",
    "import": "import_",
    "masks": "masks",
    "maps": "maps",
    "solve": "solve",
    "localise": "localise",
    "demo": "demo",
    "basis": "basis",
    "build-basis": "build_basis",
    "compare": "compare",
    "material": "material",
    "render": "render",
}


def package() -> str:
    """The name the extension is importable by; loads and registers it where needed."""
    installed = next(
        (n for n in sys.modules if n.startswith("bl_ext.") and n.endswith(".patina")), None
    )
    if installed:
        return installed
    root = Path(__file__).resolve().parent
    spec = importlib.util.spec_from_file_location(
        "patina", root / "__init__.py", submodule_search_locations=[str(root)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"no package in {root}")
    module = importlib.util.module_from_spec(spec)
    sys.modules["patina"] = module
    spec.loader.exec_module(module)
    module.register()
    return "patina"


def main(arguments: list[str]) -> int:
    """Run one command; 0 when all was done, 2 for wrong input (one line on stderr)."""
    name = package()
    errors = importlib.import_module(f"{name}.core.errors")
    signal.signal(signal.SIGTERM, _stop)  # after the libraries, some of which set their own
    parser = _Parser(prog="patina", description="Measured materials from photo scans")
    choices = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    modules = {}
    for command, file in COMMANDS.items():
        modules[command] = importlib.import_module(f"{name}.commands.{file}")
        modules[command].add_arguments(choices.add_parser(command, help=modules[command].HELP))
    told = parser.parse_args(arguments)
    try:
        modules[told.command].run(told)
    except errors.PatinaError as error:
        print(f"patina: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("patina: stopped; nothing was written", file=sys.stderr)
        return 130
    return 0


class _Parser(argparse.ArgumentParser):
    """A mistake on the command line is one line too."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (--help says more)\n")


def _stop(*_: object) -> NoReturn:
    raise KeyboardInterrupt


def own_arguments() -> list[str]:
    """What follows "--" inside Blender, all of it outside."""
    if "--" in sys.argv:
        return sys.argv[sys.argv.index("--") + 1 :]
    return sys.argv[1:]


if __name__ == "__main__":
    sys.exit(main(own_arguments()))
