"""Hash of the code that computed a row: rows of other versions may not be valid for this one."""

from __future__ import annotations

import sys
from functools import cache
from hashlib import sha256
from pathlib import Path

PACKAGES = ("patina.core.", "tools.hunt.")
OUTPUT_ONLY = tuple(f"tools.hunt.{name}" for name in ("table", "plan", "picture", "state"))
LENGTH = 8


@cache
def state() -> str:
    """Return a hash, in hexadecimal digits, of all imported files of ``core/`` and of the hunt.

    Computed at the first call, because some files are imported only when they are needed.
    """
    from . import judged

    assert judged.__file__ is not None
    found = {
        name: Path(module.__file__)
        for name, module in sys.modules.items()
        if name.startswith(PACKAGES) and name not in OUTPUT_ONLY and module.__file__ is not None
    }
    digest = sha256()
    for name in sorted(found):
        digest.update(name.encode())
        digest.update(found[name].read_bytes())
    return digest.hexdigest()[:LENGTH]
