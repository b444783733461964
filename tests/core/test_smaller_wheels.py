"""Wheels that ship without tests are still whole wheels."""

from __future__ import annotations

import base64
import hashlib
import zipfile
from pathlib import Path

from tools.smaller_wheels import is_test, shipped_wheel, write_without_tests

FILES = {
    "lib/__init__.py": "import lib.core\n",
    "lib/core.py": "x = 1\n" * 100,
    "lib/tests/__init__.py": "",
    "lib/tests/test_core.py": "assert x\n" * 500,
    "lib/deep/tests/data/a.bin": "0" * 1000,
    "lib/testing.py": "needed = True\n",
    "lib/tests.py": "a module of this name\n",
    "lib-1.0.dist-info/licenses/LICENSE": "BSD\n",
    "lib-1.0.dist-info/METADATA": "Name: lib\n",
}


def make_wheel(path: Path) -> Path:
    def digest(content: str) -> str:
        raw = hashlib.sha256(content.encode()).digest()
        return base64.urlsafe_b64encode(raw).rstrip(b"=").decode()

    record = "".join(f"{n},sha256={digest(c)},{len(c)}\n" for n, c in FILES.items())
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        for name, content in {**FILES, "lib-1.0.dist-info/RECORD": record}.items():
            made.writestr(name, content)
    return path


def test_only_tests_are_left_out_and_the_record_agrees(tmp_path):
    wheel, target = make_wheel(tmp_path / "scipy-1.0-py3-none-any.whl"), tmp_path / "small.whl"
    write_without_tests(wheel, target)
    with zipfile.ZipFile(target) as made:
        names = set(made.namelist())
        record = made.read("lib-1.0.dist-info/RECORD").decode()
        for name in names - {"lib-1.0.dist-info/RECORD"}:
            assert made.read(name).decode() == FILES[name]
    assert names == {n for n in FILES if not is_test(n)} | {"lib-1.0.dist-info/RECORD"}
    assert "lib/testing.py" in names and "lib/tests.py" in names
    listed = {line.split(",")[0] for line in record.splitlines()}
    assert listed == names - {"lib-1.0.dist-info/RECORD"}
    again = tmp_path / "again.whl"
    write_without_tests(wheel, again)
    assert again.read_bytes() == target.read_bytes()
    assert target.stat().st_size < wheel.stat().st_size


def test_other_libraries_ship_as_they_are(tmp_path, monkeypatch):
    monkeypatch.setenv("PATINA_CACHE", str(tmp_path / "cache"))
    other = make_wheel(tmp_path / "lib-1.0-py3-none-any.whl")
    assert shipped_wheel(other, "0" * 64) == other
    own = make_wheel(tmp_path / "scipy-1.0-py3-none-any.whl")
    made = shipped_wheel(own, "0" * 64)
    assert made != own and made.name == own.name
    stamp = made.stat().st_mtime_ns
    assert shipped_wheel(own, "0" * 64).stat().st_mtime_ns == stamp, "made once"
