"""A damaged environment is noticed and removed; an intact one stays."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tools import common, repair


@pytest.fixture
def environment(tmp_path, monkeypatch) -> Path:
    """An environment with one package, installed by pip from a wheel made here."""
    monkeypatch.setenv("PATINA_CACHE", str(tmp_path / "cache"))
    source = tmp_path / "source"
    (source / "small").mkdir(parents=True)
    (source / "small" / "__init__.py").write_text("VALUE = 1\n" * 50)
    (source / "pyproject.toml").write_text(
        '[build-system]\nrequires = []\nbuild-backend = "backend"\nbackend-path = ["."]\n'
    )
    (source / "backend.py").write_text(BACKEND)
    folder = tmp_path / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    site = next((folder / "lib").glob("python*/site-packages"), folder / "Lib/site-packages")
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-build-isolation",
         "--no-deps", "--target", site, source],
        check=True,
    )  # fmt: skip
    return folder


BACKEND = """
import base64, hashlib, zipfile
def build_wheel(folder, config=None, metadata=None):
    name = "small-1.0-py3-none-any.whl"
    info = "small-1.0.dist-info"
    files = {
        "small/__init__.py": open("small/__init__.py", "rb").read(),
        f"{info}/METADATA": b"Metadata-Version: 2.1\\nName: small\\nVersion: 1.0\\n",
        f"{info}/WHEEL": b"Wheel-Version: 1.0\\nGenerator: x\\nRoot-Is-Purelib: true\\nTag: py3-none-any\\n",
    }
    rows = []
    with zipfile.ZipFile(f"{folder}/{name}", "w") as archive:
        for path, data in files.items():
            archive.writestr(path, data)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            rows.append(f"{path},sha256={digest},{len(data)}")
        rows.append(f"{info}/RECORD,,")
        archive.writestr(f"{info}/RECORD", "\\n".join(rows) + "\\n")
    return name
"""  # noqa: E501


def python_of(environment: Path) -> Path:
    return environment / "bin" / "python"


def test_intact_environment_stays(environment):
    assert repair.damaged_files(environment) == []
    repair.remove_if_damaged(python_of(environment), 1)
    assert environment.is_dir()


@pytest.mark.parametrize("damage", ["truncated", "missing", "changed"])
def test_damaged_environment_is_removed(environment, damage, capsys):
    (module,) = environment.rglob("small/__init__.py")
    if damage == "missing":
        module.unlink()
    elif damage == "truncated":
        module.write_bytes(module.read_bytes()[:40])
    else:
        module.write_bytes(module.read_bytes().replace(b"1", b"2"))
    repair.remove_if_damaged(python_of(environment), 2)  # wrong input is no sign of damage
    assert environment.is_dir()
    repair.remove_if_damaged(python_of(environment), 128 + 7)
    assert not environment.exists()
    assert "were damaged (first __init__.py)" in capsys.readouterr().err


def test_cache_that_cannot_be_a_folder_is_one_sentence(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("PATINA_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.raises(common.Failure, match=r"set PATINA_CACHE to a folder"):
        common.cache_dir()
