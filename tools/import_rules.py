"""The import rules of pyproject.toml ([tool.importlinter]), checked by import-linter.

The checkout is the package, whatever its folder is called: import-linter is shown it as `patina`
through a link in an empty folder.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

from .common import ROOT, cache_dir, call

RULES = ROOT / "pyproject.toml"
CHECK = """
import sys
from importlinter.cli import lint_imports
sys.exit(lint_imports(sys.argv[1], no_cache=True, no_logo=True))
"""


def check_imports(python: Path) -> int:
    """Return 0 where no import breaks a rule; prints the chain of those that do."""
    with tempfile.TemporaryDirectory(dir=cache_dir(), prefix="imports-") as folder:
        package = Path(folder) / "patina"
        try:
            package.symlink_to(ROOT, target_is_directory=True)
        except OSError:  # Windows without the right to make links
            shutil.copytree(ROOT, package, ignore=shutil.ignore_patterns(".git", "dist", "wheels"))
        environment = {**os.environ, "PYTHONPATH": folder}
        return call([python, "-c", CHECK, RULES], env=environment)
