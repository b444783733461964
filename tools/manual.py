"""Build the documentation site into assets/manual, where Blender's Online Manual finds it.

The site is made for local files, and loads nothing from the network. It is not part of the
repository; the zips of the extension contain it. Its packages are installed into the cache.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

from .common import ROOT, Failure, cache_dir, one_at_a_time, quietly, say

MANUAL = ROOT / "assets" / "manual"
REQUIREMENTS = ROOT / "docs" / "requirements.txt"
MARK = "built.txt"  # in MANUAL: the hash of its sources
UNUSED = ("sitemap.xml*", "404.html", "**/*.map", "assets/javascripts/lunr", "search")
"""What only a server, a developer or the search needs."""


def build() -> Path:
    """Return the folder of the site, built if it is missing or its sources have changed. Broken
    links and anchors are errors. Raises Failure."""
    current = _source_hash()
    with one_at_a_time("manual"):
        if (MANUAL / MARK).is_file() and (MANUAL / MARK).read_text("utf-8") == current:
            return MANUAL
        say("building the documentation site")
        partial = MANUAL.with_name("manual.part")
        shutil.rmtree(partial, ignore_errors=True)
        command: list[str | Path] = [_python(), "-m", "mkdocs", "build", "--strict", "--quiet"]
        command += ["--config-file", ROOT / "mkdocs.yml", "--site-dir", partial]
        own = {"WITH_SERVER": "false", "NO_MKDOCS_2_WARNING": "1"}
        quietly(command, "mkdocs", env={**os.environ, **own})
        for pattern in UNUSED:
            for path in list(partial.glob(pattern)):
                shutil.rmtree(path) if path.is_dir() else path.unlink()
        (partial / MARK).write_text(current, "utf-8")
        shutil.rmtree(MANUAL, ignore_errors=True)
        partial.rename(MANUAL)
    return MANUAL


def build_if_possible() -> None:
    """Build the site; where that fails, print why."""
    try:
        build()
    except (Failure, OSError, subprocess.SubprocessError) as error:
        say(f"note: the manual cannot be built ({error}); Blender will have no Online Manual of it")


def _python() -> Path:
    """The Python of the environment with the site's packages."""
    folder = cache_dir() / "docs-site"
    python = folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    mark, wanted = folder / "installed", hashlib.sha256(REQUIREMENTS.read_bytes()).hexdigest()
    if not (python.is_file() and mark.is_file() and mark.read_text("utf-8") == wanted):
        venv.create(folder, with_pip=True, clear=True)
        install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        quietly([python, *install, "-r", REQUIREMENTS], "pip")
        mark.write_text(wanted, "utf-8")
    return python


def _source_hash() -> str:
    digest = hashlib.sha256()
    sources = [ROOT / "mkdocs.yml", ROOT / "tools" / "docs_site.py", Path(__file__)]
    for folder in (ROOT / "docs", ROOT / "assets" / "schemas"):
        sources += sorted(path for path in folder.rglob("*") if path.is_file())
    for path in sources:
        digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


if __name__ == "__main__":
    print(build())
