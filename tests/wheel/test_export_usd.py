"""USD export: compliant by USD's own checker, with both kinds of material in it."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import pytest

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
    return json.loads(done.stdout.splitlines()[-1])


def test_usdchecker_reports_no_issues(checker_output: list) -> None:
    checked, issues, undefined, _, default = checker_output
    assert checked > 0 and default == "/root"
    ours = [x for x in issues if not (x[0] == "MissingShaderIdInRegistry" and "'ND_" in x[1])]
    assert ours == []
    assert not undefined  # None if the MaterialX package is not installed


def test_usd_contains_both_materials(checker_output: list) -> None:
    found = checker_output[3]
    assert set(found) == {"bronze", "old_rug"}
    kind, inputs = found["old_rug"][""]
    assert kind == "UsdPreviewSurface"
    assert inputs["diffuseColor"] == pytest.approx([0.5, 0.25, 0.1], abs=1e-5)
    assert inputs["clearcoat"] == pytest.approx(0.2, abs=1e-5)
    import bpy

    if "generate_materialx_network" not in bpy.ops.wm.usd_export.get_rna_type().properties:
        return
    kind, inputs = found["old_rug"]["mtlx"]
    assert kind in ("ND_open_pbr_surface_surfaceshader", "ND_standard_surface_surfaceshader")
    assert inputs["coat_weight" if "open" in kind else "coat"] == pytest.approx(0.2, abs=1e-5)
