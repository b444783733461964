"""Import the checkout as the package `patina`, independent of the name of its folder."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[1]


def load_patina() -> ModuleType:
    """Import the repository root as `patina`, so that `import patina.core...` works.

    In Blender the same files are `bl_ext.user_default.patina`; therefore all imports in them are
    relative. bpy is not used before `patina.register()` is called.
    """
    if "patina" in sys.modules:
        return sys.modules["patina"]
    spec = importlib.util.spec_from_file_location(
        "patina", ROOT / "__init__.py", submodule_search_locations=[str(ROOT)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"no package in {ROOT}")
    module = importlib.util.module_from_spec(spec)
    sys.modules["patina"] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules["patina"]
        raise
    return module
