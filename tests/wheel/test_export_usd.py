"""USD export: compliant by USD's own checker, with both kinds of material in it."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest

from patina.core.appearance.open_pbr.model import OpenPBR
from tests import make_result as made

pytestmark = pytest.mark.blender

# In a process of its own: usd-core and the USD inside bpy are two libraries of one name. Earlier
# usd-core versions have the checker behind usdchecker, later ones the validators that it uses.
# usd-core has no MaterialX nodes: those are looked up in MaterialX's own library instead.
CHECK = """
import json, sys
from pxr import Usd, UsdShade, UsdUtils
stage = Usd.Stage.Open(sys.argv[1])
found = {}
ids = set()
for prim in stage.Traverse():
    if prim.IsA(UsdShade.Shader):
        ids.add(UsdShade.Shader(prim).GetIdAttr().Get())
    if prim.IsA(UsdShade.Material):
        kinds = {}
        for context in ("", "mtlx"):
            shader = UsdShade.Material(prim).ComputeSurfaceSource(context)[0]
            if shader:
                values = {i.GetBaseName(): i.Get() for i in shader.GetInputs()}
                plain = {k: list(v) if hasattr(v, "__len__") and not isinstance(v, str) else v
                         for k, v in values.items() if v is not None}
                kinds[context] = [shader.GetIdAttr().Get(), plain]
        found[prim.GetName()] = kinds
issues, checked = [], 0
if hasattr(UsdUtils, "ComplianceChecker"):
    checker = UsdUtils.ComplianceChecker(arkit=False)
    checker.CheckCompliance(sys.argv[1])
    issues += [["", x] for x in checker.GetErrors() + checker.GetFailedChecks()
             + checker.GetWarnings()]
    checked += 1
try:
    from pxr import UsdValidation
    registry = UsdValidation.ValidationRegistry()
    names = [m.name for m in registry.GetAllValidatorMetadata()]
    validators = registry.GetOrLoadValidatorsByName(names)
    for error in UsdValidation.ValidationContext(validators).Validate(stage):
        issues.append([error.GetName(), error.GetMessage()])
    checked += len(names)
except ImportError:
    pass
undefined = None
try:
    import MaterialX as mx
    library = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    undefined = [i for i in ids if i.startswith("ND_") and library.getNodeDef(i) is None]
except ImportError:
    pass
print(json.dumps([checked, issues, undefined, found, str(stage.GetDefaultPrim().GetPath())]))
"""


@pytest.fixture(scope="module")
def checker_output(root: Path, tmp_path_factory: pytest.TempPathFactory) -> list:
    if importlib.util.find_spec("pxr") is None:
        pytest.skip("the usd-core package is not installed")
    folder = tmp_path_factory.mktemp("usd")
    result = made.two_materials(folder / "result")
    done = subprocess.run(
        [sys.executable, root / "headless.py", "material", result, "--to", "usd", "--out",
         folder / "out"], capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    file = folder / "out" / "materials.usdc"
    done = subprocess.run(
        [sys.executable, "-c", CHECK, file], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return [*json.loads(done.stdout.splitlines()[-1]), made.subjects(result)]


def test_usdchecker_reports_no_issues(checker_output: list) -> None:
    checked, issues, undefined, _, default, _ = checker_output
    assert checked > 0 and default == "/root"
    ours = [x for x in issues if not (x[0] == "MissingShaderIdInRegistry" and "'ND_" in x[1])]
    assert ours == []
    assert not undefined  # None if the MaterialX package is not installed


def test_usd_contains_surfaces_fitted_for_it(checker_output: list) -> None:
    found, subjects = checker_output[3], checker_output[5]
    assert set(found) == {"bronze", "old_rug"}
    import bpy

    for subject in subjects:
        shown = found[subject.name.replace(" ", "_")]
        kind, inputs = shown[""]
        assert kind == "UsdPreviewSurface"
        preview = subject.preview_surface.principled
        assert inputs["diffuseColor"] == pytest.approx(preview.base_color, abs=1e-5)
        assert inputs["clearcoat"] == pytest.approx(preview.coat_weight, abs=1e-5)
        if "generate_materialx_network" not in bpy.ops.wm.usd_export.get_rna_type().properties:
            continue
        kind, inputs = shown["mtlx"]
        assert kind in ("ND_open_pbr_surface_surfaceshader", "ND_standard_surface_surfaceshader")
        if "open" in kind:
            for field in fields(OpenPBR):
                fitted = getattr(subject.open_pbr.surface, field.name)
                assert inputs[field.name] == pytest.approx(fitted, abs=1e-5), field.name


def test_identifiers_of_usd_are_those_that_blender_writes(tmp_path: Path) -> None:
    """Every name is found among the guesses, and names that share an identifier are."""
    pytest.importorskip("pxr")
    import bpy
    from pxr import Usd, UsdShade

    from patina.scene.export.export_scene import new_scene
    from patina.scene.export.export_usd import write_usd
    from patina.scene.export.usd_surfaces import prim_names

    names = ["1st", "Émail", "é tail", "a·b", "old rug", "漆", "_x", "a-b.001"]
    new_scene()
    objects = []
    for name in names:
        material = bpy.data.materials.new(name)
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
        mesh.materials.append(material)
        thing = bpy.data.objects.new(name, mesh)
        bpy.context.scene.collection.objects.link(thing)
        objects.append(thing)
    bpy.context.view_layer.update()
    write_usd(tmp_path / "names.usdc", objects)
    stage = Usd.Stage.Open(str(tmp_path / "names.usdc"))
    found = {p.GetName() for p in stage.Traverse() if p.IsA(UsdShade.Material)}
    for name in names:
        assert prim_names(name) & found, (name, found)
    assert prim_names("old rug") & prim_names("old_rug")
    bpy.ops.wm.read_homefile(use_empty=True)
