"""Run Patina without a graphical interface.

blender -b --python-exit-code 1 -P headless.py -- COMMAND …
python headless.py COMMAND …                            (with the bpy wheel)

In a Blender in which the extension is enabled, the installed extension is used. Otherwise the files
in the folder of this script are imported as package "patina".
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path


def package() -> str:
    """Return the importable name of the extension; import and register it if necessary."""
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
    """Run one command. Return 0 on success, 2 for wrong input (one line on stderr)."""
    command_line = importlib.import_module(f"{package()}.commands.command_line")
    return int(command_line.main(arguments))


def own_arguments() -> list[str]:
    """Return the arguments after "--" in Blender, and all arguments outside Blender."""
    if "--" in sys.argv:
        return sys.argv[sys.argv.index("--") + 1 :]
    return sys.argv[1:]


if __name__ == "__main__":
    sys.exit(main(own_arguments()))
