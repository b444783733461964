"""The released package: manifest, wheels, and the modules that the code may import."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from tools import staging, wheels

ROOT = Path(__file__).resolve().parents[2]
SETUP = (
    "__init__", "blender", "build", "check_package", "checks", "common", "environment",
    "extension", "headless", "import_rules", "inside", "package", "staging", "wheels",
)  # fmt: skip
ROOMS = ("core", "scene", "operators", "panels", "commands")
LIBRARIES = {"numpy", "scipy", "pycolmap", "OpenImageIO", "embreex"} | {
    "defusedxml",
    "sunposition",
    "threadpoolctl",
    "tomlkit",
    "rawpy",  # where it exists
    "flip_evaluator",  # likewise
    "dask",  # likewise, with the next three
    "distributed",
    "cloudpickle",
    "psutil",
}
BLENDER = {
    "bpy",
    "_cycles",
    "bl_operators",
    "bl_ui",
    "bpy_extras",
    "mathutils",
    "bmesh",
    "gpu",
    "gpu_extras",
    "blf",
    "addon_utils",
    "pxr",
}
# The tag list of the Blender extensions platform.
TAGS = {
    "3D View", "Add Curve", "Add Mesh", "Animation", "Bake", "Camera", "Compositing",
    "Development", "Game Engine", "Geometry Nodes", "Grease Pencil", "Import-Export", "Lighting",
    "Material", "Mesh", "Modeling", "Node", "Object", "Paint", "Physics", "Pipeline", "Render",
    "Rigging", "Scene", "Sculpt", "Sequencer", "System", "Text Editor", "Tracking",
    "User Interface", "UV",
}  # fmt: skip


def sources(*rooms: str) -> list[Path]:
    """The Python files of some packages, and the root package's own where "." is given."""
    found = [ROOT / "__init__.py"] if "." in rooms else []
    for room in rooms:
        if room != ".":
            found += sorted((ROOT / room).rglob("*.py"))
    return found


def imports(path: Path) -> Iterator[tuple[int, str]]:
    """Yield (line, top-level name) of every absolute import in a file."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name.partition(".")[0]) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.lineno, node.module.partition(".")[0]


def forbidden_imports(paths: list[Path], allowed: set[str]) -> list[str]:
    """Every import of those files that is neither relative nor allowed, as "file:line name"."""
    known = allowed | set(sys.stdlib_module_names)
    return [
        f"{path.relative_to(ROOT)}:{line} {name}"
        for path in paths
        for line, name in imports(path)
        if name not in known
    ]


@pytest.fixture(scope="module")
def manifest() -> dict:
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


def test_manifest_has_fields_required_by_blender(manifest: dict) -> None:
    assert manifest["schema_version"] == "1.0.0"
    assert manifest["id"] == "patina"
    assert manifest["blender_version_min"] == "4.2.0"
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert set(manifest["tags"]) <= TAGS
    assert re.fullmatch(r"\d+\.\d+\.\d+", manifest["version"])
    assert manifest["website"].startswith("https://")
    assert all(re.fullmatch(r"\d{4}(-\d{4})? \S.*", one) for one in manifest["copyright"])
    for sentence in (manifest["tagline"], *manifest["permissions"].values()):
        assert len(sentence) < 64
        assert not sentence.endswith(".")


def test_citation_and_manifest_agree(manifest: dict) -> None:
    """The version and the licence in CITATION.cff, and the works that the method builds on."""
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {manifest['version']}\n" in text
    assert f"\nlicense: {manifest['license'][0].removeprefix('SPDX:')}\n" in text
    for title in ("reliable geometric regions", "minimal BRDF sampling", "Neural BRDF"):
        assert title in text


def test_manifest_lists_exactly_the_pinned_wheels(manifest: dict) -> None:
    assert manifest["wheels"] == [f"./wheels/{name}" for name in wheels.wheel_names()]
    assert tuple(manifest["platforms"]) == wheels.PLATFORMS


def test_wheels_cover_every_platform_and_python() -> None:
    pure = sum(tags is None for tags in wheels.TAGS.values())  # one wheel serves all of them
    each = len(wheels.PLATFORMS) * len(wheels.PYTHONS)
    assert len(set(wheels.wheel_names())) == (len(wheels.PINS) - pure) * each + pure
    raw = set(wheels.wheel_names(raw=True)) - set(wheels.wheel_names())
    assert len(raw) == each and all(name.startswith("rawpy-") for name in raw)
    assert set(wheels.checksums()) == set(wheels.wheel_names(raw=True))


def test_numpy_is_not_shipped(manifest: dict) -> None:
    assert not [name for name in manifest["wheels"] if "numpy" in name.lower()]


def test_platform_filter_changes_only_wheels_and_platforms(manifest: dict) -> None:
    text = staging.filtered_manifest(["macos-arm64"], ["cp313"], raw=False)
    filtered = tomllib.loads(text)
    assert filtered["platforms"] == ["macos-arm64"]
    names = wheels.wheel_names(["macos-arm64"], ["cp313"])
    assert filtered["wheels"] == [f"./wheels/{name}" for name in names]
    same = ("platforms", "wheels")
    assert {k: v for k, v in filtered.items() if k not in same} == {
        k: v for k, v in manifest.items() if k not in same
    }


def test_only_the_extension_is_shipped() -> None:
    allowed = {
        *ROOMS, "assets", "__init__.py", "api.py", "headless.py", "blender_manifest.toml",
        "LICENSE", "README.md", "CHANGELOG.md",
    }  # fmt: skip
    assert {path.name for path in staging.shipped()} <= allowed


def test_imports_are_relative_or_from_allowed_libraries() -> None:
    assert not forbidden_imports(sources(".", *ROOMS[1:]), LIBRARIES | BLENDER)
    assert not forbidden_imports([ROOT / "headless.py", ROOT / "api.py"], LIBRARIES | BLENDER)


def test_core_does_not_import_blender() -> None:
    # OpenEXR's own wheel is not allowed either: it exports the C functions of the OpenEXR library,
    # and on Linux those of Blender's copy are called in their place. Writing then fails and
    # corrupts memory. OpenImageIO keeps its copy private and writes the same files.
    assert not forbidden_imports(sources("core"), LIBRARIES)


def test_core_loads_without_blender() -> None:
    import subprocess

    code = (
        "import sys; sys.modules['bpy'] = None; from tools.package import load_patina; "
        "load_patina(); import patina.core, pkgutil, importlib; "
        "[importlib.import_module(m.name) for m in "
        "pkgutil.walk_packages(patina.core.__path__, 'patina.core.')]"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_tools_need_only_the_standard_library() -> None:
    """run.py runs on a bare Python: so must every module it imports outside an environment."""
    own = [ROOT / "tools" / f"{name}.py" for name in SETUP]
    assert not forbidden_imports([*own, ROOT / "run.py"], {"tools"})


def test_no_file_is_longer_than_500_lines() -> None:
    paths = [ROOT / "run.py", *sources(".", *ROOMS, "tools", "tests")]
    long = {
        str(path.relative_to(ROOT)): lines
        for path in paths
        if (lines := len(path.read_text(encoding="utf-8").splitlines())) > 500
    }
    assert not long


def test_shipped_code_neither_changes_search_path_nor_evaluates_strings() -> None:
    pattern = re.compile(
        r"sys\.path\s*(\.|\+=|=|\[)|sys\.modules\s*(\.(?!items)|\[)|(?<![.\w])(eval|exec)\("
        r"|\bpickle\b|\bpip install"
    )
    found = [
        (path.relative_to(ROOT).as_posix(), line.strip())
        for path in sources(".", *ROOMS)
        for line in path.read_text(encoding="utf-8").splitlines()
        if pattern.search(line)
    ]
    # the objects that a child process gets from its parent and returns to it, and no other file
    assert {file for file, _ in found} <= {"core/child_process/object_files.py"}, found
    assert all("pickle" in line for _, line in found), found
