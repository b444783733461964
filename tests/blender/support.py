"""Shared helpers of the tests in Blender: the installed extension, and how to skip a test."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

INSTALLED = "bl_ext.user_default.patina"
ROOT = Path(__file__).resolve().parents[2]


class Skip(Exception):
    """Raised by a test that cannot run on this Blender; the message says why."""


def installed() -> bool:
    """Say whether the extension was installed from a zip and enabled."""
    return INSTALLED in sys.modules


def extension(inside: str = "") -> ModuleType:
    """Return the extension, or a module of it: `extension("core.fit")`.

    Where no zip is installed (the bpy wheel) it is the checkout, as package `patina`, registered.
    """
    if installed():
        package = INSTALLED
    else:
        package = "patina"
        if package not in sys.modules:
            spec = importlib.util.spec_from_file_location(
                package, ROOT / "__init__.py", submodule_search_locations=[str(ROOT)]
            )
            module = importlib.util.module_from_spec(spec)
            sys.modules[package] = module
            spec.loader.exec_module(module)
            module.register()
    return importlib.import_module(f"{package}.{inside}" if inside else package)


def without_window(operator: type, **properties: object):
    """Start an operator's generator without a window; its messages are in ``reports``."""
    import bpy

    plain = tuple(kind for kind in operator.__bases__ if not issubclass(kind, bpy.types.Operator))
    own = {key: value for key, value in vars(operator).items() if key != "__dict__"}
    reports: list[str] = []
    own |= {
        "reports": reports,
        "report": lambda self, kind, text: reports.append(text),
        **properties,
    }
    made = type("Ticked", plain, own)()
    made._start(bpy.context)
    if hasattr(made, "_begin"):  # a Stepped operator
        made._begin()
    return made
