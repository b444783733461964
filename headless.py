"""Patina without a window.

blender -b --python-exit-code 1 -P headless.py -- COMMAND …
python headless.py COMMAND …                            (with the bpy wheel)

Inside a Blender that has the extension enabled, that extension runs; otherwise the files beside
this one do, as package "patina".
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path


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
    command_line = importlib.import_module(f"{package()}.commands.command_line")
    return int(command_line.main(arguments))


def own_arguments() -> list[str]:
    """What follows "--" inside Blender, all of it outside."""
    if "--" in sys.argv:
        return sys.argv[sys.argv.index("--") + 1 :]
    return sys.argv[1:]


if __name__ == "__main__":
    sys.exit(main(own_arguments()))
