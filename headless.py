"""Run Patina without a graphical interface.

blender -b --python-exit-code 1 -P headless.py -- COMMAND …
python headless.py COMMAND …                            (in a checkout, with the bpy wheel)

In Blender the installed extension is used; it is enabled for this run if it is not. In a checkout
the files of the checkout are used.
"""

from __future__ import annotations

import importlib
import runpy
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent
CHECKOUT = ROOT / "tools" / "package.py"  # is not shipped


def package() -> str:
    """The importable name of Patina, which is registered in Blender."""
    enabled = next(
        (n for n in sys.modules if n.startswith("bl_ext.") and n.endswith(".patina")), None
    )
    if enabled:
        return enabled
    installed = extension_name()
    if installed:
        addon_utils = importlib.import_module("addon_utils")
        if addon_utils.enable(installed) is not None:
            return installed
    elif CHECKOUT.is_file():
        module = runpy.run_path(str(CHECKOUT))["load_patina"]()
        module.register()
        return str(module.__name__)
    sys.exit("patina: not installed in this Blender; install the extension from its zip file")


def extension_name() -> str | None:
    """The name of this folder as an extension; None if it is in none of Blender's repositories."""
    repositories = importlib.import_module("bpy").context.preferences.extensions.repos
    for one in repositories:
        if Path(one.directory).resolve() == ROOT.parent:
            return f"bl_ext.{one.module}.{ROOT.name}"
    return None


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
