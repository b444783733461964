"""OpenPBR and the lobe stack of MaterialX in numpy, against the shaders that MaterialX generates
from the exported documents, run by a browser."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from patina.core.appearance.layered_model import Configuration
from patina.core.appearance.lobe_stack import Lobe, LobeStack
from patina.core.appearance.open_pbr.model import OpenPBR
from patina.core.export import materialx, materialx_model
from tests.browser import browser

mx = pytest.importorskip("MaterialX")
pytestmark = pytest.mark.slow

GOLD, BLUE = np.array([0.9, 0.6, 0.2]), np.array([0.2, 0.5, 1.0])
SURFACES = [
    OpenPBR(),
    OpenPBR(base_color=GOLD, specular_roughness=0.9, base_diffuse_roughness=0.7),
    OpenPBR(specular_weight=0.3, specular_color=BLUE, specular_ior=2.2),
    OpenPBR(base_color=GOLD, base_metalness=1.0, specular_color=BLUE, specular_roughness=0.5),
    OpenPBR(base_color=GOLD, base_metalness=0.4, specular_weight=0.7, specular_roughness=0.6),
    OpenPBR(coat_weight=1.0, coat_color=BLUE, coat_roughness=0.4, coat_ior=1.9),
    OpenPBR(
        base_color=BLUE, base_metalness=0.5, coat_weight=0.5, coat_darkening=0.0, specular_ior=1.3
    ),
    OpenPBR(fuzz_weight=0.8, fuzz_color=GOLD, fuzz_roughness=0.3, base_color=BLUE),
    OpenPBR(fuzz_weight=0.5, fuzz_roughness=0.9, coat_weight=0.3, coat_roughness=0.1),
]
STACK = LobeStack(
    diffuse=GOLD,
    diffuse_roughness=0.6,
    lobes=(
        Lobe(np.full(3, 0.05), np.ones(3), 0.15),
        Lobe(0.5 * BLUE, np.array([0.9, 0.8, 0.7]), 0.5, f0_edge=0.3 * GOLD),
    ),
    diffuse_mid=0.7 * GOLD,
    diffuse_edge=0.5 * BLUE,
)
PAIRS = [
    tuple(np.array(d) / np.linalg.norm(d) for d in pair)
    for pair in (
        ([0.0, 0.0, 1.0], [0.6, 0.2, 0.77]),
        ([0.3, -0.2, 0.93], [-0.8, 0.1, 0.4]),
        ([0.0, 0.6, 0.8], [0.0, 0.7, 0.71]),
    )
]  # view and light
# without an environment the generator uses u_refractionTwoSided, but does not declare it
LIGHTS = "uniform int u_numActiveLightSources;"
MIN_COSINE = 0.05  # of light and view with the normals that are compared
MAX_ERROR = 1e-3  # of the radiance, relative to its 90th percentile
NORMALS = 2000


def test_open_pbr_equals_the_shader_of_materialx(tmp_path):
    root = materialx.document()
    materialx.add_open_pbr(root, "gold", OpenPBR())
    materialx.write(tmp_path / "gold.mtlx", root)
    fragment, uniforms = generated_shader(tmp_path / "gold.mtlx", "gold_surface")
    draws = [(uniforms | inputs(surface), *pair) for surface in SURFACES for pair in PAIRS]
    shown = iter(radiances(tmp_path, fragment, draws))
    for surface in SURFACES:
        for view, light in PAIRS:
            assert_equal(next(shown), surface.at, view, light)


def test_the_lobe_stack_equals_the_shader_of_materialx(tmp_path):
    root = materialx.document()
    materialx.add_lobe_stack(root, "gold", STACK)
    materialx.write(tmp_path / "gold.mtlx", root)
    fragment, uniforms = generated_shader(tmp_path / "gold.mtlx", "gold_surface")
    shown = radiances(tmp_path, fragment, [(uniforms, *pair) for pair in PAIRS])

    for found, (view, light) in zip(shown, PAIRS, strict=True):
        assert_equal(found, partial(materialx_model.at, STACK), view, light)


def assert_equal(shown: np.ndarray, at, view: np.ndarray, light: np.ndarray) -> None:
    """Compare radiances (NORMALS, 3) with a BRDF that is a function of a Configuration."""
    where = Configuration.around(sphere_normals(), light, view)
    expected = at(where) * where.cos_i[:, None]
    seen = (where.cos_i > MIN_COSINE) & (where.cos_o > MIN_COSINE)
    error = np.abs(shown - expected)[seen].max() / np.percentile(expected[seen], 90)
    assert seen.sum() > 300 and error < MAX_ERROR


def radiances(
    folder: Path, fragment: str, draws: Sequence[tuple[dict, np.ndarray, np.ndarray]]
) -> list[np.ndarray]:
    """For each draw (uniforms, view, light) the radiance (NORMALS, 3) in the browser."""
    script = (browser.FOLDER / "materialx_page.js").read_text("utf-8")
    page_file = folder / "page.html"
    page_file.write_text(
        f'<!DOCTYPE html><link rel="icon" href="data:,"><script>{script}</script>', "utf-8"
    )
    options = {
        "fragment": fragment,
        "normals": sphere_normals().ravel().tolist(),
        "draws": [
            {"uniforms": uniforms, "view": view.tolist(), "light": light.tolist()}
            for uniforms, view, light in draws
        ],
    }
    with browser.opened(page_file, (200, 200)) as (page, errors):
        texts = page.evaluate("(options) => window.evaluateSurface(options)", options)
        assert errors == []
    return [np.frombuffer(base64.b64decode(t), "<f4").reshape(-1, 4)[:, :3] for t in texts]


def sphere_normals() -> np.ndarray:
    """(NORMALS, 3) unit normals, evenly over the sphere (Fibonacci's spiral)."""
    place = np.arange(NORMALS) + 0.5
    z, phi = 1 - 2 * place / NORMALS, np.pi * (1 + np.sqrt(5)) * place
    sine = np.sqrt(1 - z**2)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), z], axis=1)


def inputs(surface: OpenPBR) -> dict[str, object]:
    """The surface's inputs as values of JSON."""
    found = {}
    for field in fields(surface):
        value = getattr(surface, field.name)
        found[field.name] = [float(v) for v in value] if np.ndim(value) else float(value)
    return found


def generated_shader(file: Path, name: str) -> tuple[str, dict[str, object]]:
    """(fragment shader, values of its public uniforms) of a surface node of a document."""
    from MaterialX import PyMaterialXGenGlsl as to_glsl
    from MaterialX import PyMaterialXGenShader as to_shader

    library, document = mx.createDocument(), mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    mx.readFromXmlFile(document, str(file))
    document.setDataLibrary(library)
    generator = to_glsl.EsslShaderGenerator.create()
    context = to_shader.GenContext(generator)
    context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
    options = context.getOptions()
    options.hwSpecularEnvironmentMethod = (
        to_shader.HwSpecularEnvironmentMethod.SPECULAR_ENVIRONMENT_NONE
    )
    options.hwMaxActiveLightSources = 1
    light = library.getNodeDef("ND_directional_light")
    to_shader.HwShaderGenerator.bindLightShader(light, 1, context)
    shader = generator.generate("shader", document.getNode(name), context)
    values: dict[str, object] = {}
    stage = shader.getStage(to_shader.PIXEL_STAGE)
    for variable in stage.getUniformBlocks()["PublicUniforms"]:
        kind, found = variable.getType().getName(), variable.getValue()
        if found is None:
            continue
        words = found.getValueString()
        if kind == "boolean":
            values[variable.getVariable()] = words == "true"
        elif kind in ("float", "integer"):
            values[variable.getVariable()] = float(words)
        elif kind in ("color3", "vector3", "vector2"):
            values[variable.getVariable()] = [float(v) for v in words.split(",")]
    source = shader.getSourceCode(to_shader.PIXEL_STAGE)
    return source.replace(LIGHTS, f"{LIGHTS}\nuniform bool u_refractionTwoSided;"), values
