"""Preferences of the extension: each of them changes its behaviour."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from support import extension
from test_workflow import folder, make_capture_module


@contextmanager
def preferred(**changes: object) -> Iterator[object]:
    """The extension's preferences with these changes; a checkout gets a temporary entry."""
    addons, package = bpy.context.preferences.addons, extension().__name__
    before = addons.get(package)
    entry = before
    if entry is None:
        entry = addons.new()
        entry.module = package
    for name, value in changes.items():
        setattr(entry.preferences, name, value)
    try:
        yield entry.preferences
    finally:
        for name in changes:
            entry.preferences.property_unset(name)
        if before is None:
            addons.remove(entry)


class ReportRecorder:
    """An operator stand-in that records its reports."""

    def __init__(self) -> None:
        self.reports: list[str] = []

    def report(self, kind: set[str], text: str) -> None:
        self.reports.append(text)


def imported(extra: str = ""):
    path = make_capture_module().make_capture(folder() / "ball", photos=2, extra=extra)
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    return path


def test_defaults_without_preferences_entry() -> None:
    read = extension("scene.session.preferences")
    with preferred():
        assert read.preferences() == read.Preferences()
        assert read.preferences().margins == extension("core.samples").Margins()
    assert read.preferences() == read.Preferences()


def test_margins_apply_to_captures_without_own_margins() -> None:
    fit, margins = extension("operators.fit"), extension("core.samples").Margins
    scene = bpy.context.scene
    imported("[fit]\nshadow_margin = 9")
    changes, operator = {"silhouette": 5, "shadow": 6, "mask": 7, "cosine": 0.25}, ReportRecorder()
    with preferred(**changes):
        job = fit.fit_job(operator, scene)
    assert job.capture.fit.margins == margins(silhouette=5, shadow=9, mask=7, cosine=0.25)
    assert any("silhouette 5" in report for report in operator.reports)
    assert fit.fit_job(ReportRecorder(), scene).capture.fit.margins == margins(shadow=9)


def test_wider_margins_give_fewer_samples() -> None:
    fit = extension("operators.fit")
    imported("[fit]\nmethod = 'paper'\nheld_out = false\ntrials = 20")
    found = []
    for silhouette in (2, 8):
        with preferred(silhouette=silhouette):
            job = fit.fit_job(ReportRecorder(), bpy.context.scene)
        job.portable = False
        job.drain()
        found.append(job.result.materials[0].samples)
        described = vars(job.result.capture.fit.margins)
        assert described["silhouette"] == silhouette
    assert found[1] < 0.9 * found[0], found


def test_lengths_are_shown_in_preferred_unit() -> None:
    lengths, stages = extension("scene.session.lengths"), extension("scene.views.workflow_stages")
    imported()
    sentence = "2 % of it spreads over 0.02 scan units, so that 1.5e+02 scan units away"
    assert lengths.with_lengths(sentence) == sentence
    assert "2 scan units long" in stages.stages(bpy.context.scene)["scan"].has[0]
    for unit, ball, near in (
        ("METRES", "2 m long", "2 cm, so that 150 m away"),
        ("CENTIMETRES", "2 cm long", "so that 1.5 m away"),
        ("MILLIMETRES", "2 mm long", "so that 15 cm away"),
    ):
        with preferred(unit=unit):
            assert ball in stages.stages(bpy.context.scene)["scan"].has[0], unit
            assert near in lengths.with_lengths(sentence), lengths.with_lengths(sentence)


def test_cache_folder_is_used_for_unsaved_files() -> None:
    folders, place = extension("scene.session.folders"), folder()
    usual = folders.own_folder(), folders.cache_folder()
    with preferred(cache_folder=str(place)):
        assert folders.cache_folder() == place
        assert folders.own_folder() == folders.blend_folder() == place / "files"
        assert place in folders.rectified_folder(place / "x.capture.toml").parents
        if extension("scene.material.material_nodes").osl_missing() is None:
            basis = extension("core.basis")
            brdf = basis.PrincipalBRDF(basis.default_basis(), np.full((3, 4), 0.01))
            extension("scene.material.osl_files").ensure_files(brdf)
            assert len(list((place / "files").glob("patina_*.exr"))) == 3
    assert (folders.own_folder(), folders.cache_folder()) == usual


def fill_cache(place: Path) -> list[Path]:
    """Files of every kind, oldest first, 1 MB each; the last two do not belong to the cache."""
    names = (
        "files/patina_components_0123456789ab.exr",
        "files/rectified/ball-1/photo.exr",
        "merl_basis_1.npz",
        "files/patina_brdf_0123456789ab.exr",
        "files/masks/ball-1/painted.png",
        "files/mine.exr",
    )
    for age, name in enumerate(names):
        path = place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(bytes(1_000_000))
        os.utime(path, (1e9 + age, 1e9 + age))
    return [place / name for name in names]


def test_cache_is_cleared_except_files_in_use() -> None:
    place, cache = folder(), extension("scene.material.file_cache")
    with preferred(cache_folder=str(place)):
        assert not bpy.ops.patina.empty_cache.poll()
        files = fill_cache(place)
        assert sum(cache.cached_files().values()) == 4_000_000
        shown = bpy.data.images.new("shown", 4, 4)
        shown.filepath = str(files[1])
        assert bpy.ops.patina.empty_cache() == {"FINISHED"}
        assert [p.exists() for p in files] == [False, True, False, False, True, True]
        bpy.data.images.remove(shown)
        bpy.ops.patina.empty_cache()
        assert not files[1].exists() and not bpy.ops.patina.empty_cache.poll()


def test_oldest_cache_files_are_removed_on_load() -> None:
    place = folder()
    blend = place / "x.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    files = fill_cache(place)
    with preferred(cache_folder=str(place), cache_size=4):
        bpy.ops.wm.open_mainfile(filepath=str(blend))
        assert all(p.exists() for p in files)
        bpy.context.preferences.addons[extension().__name__].preferences.cache_size = 2
        bpy.ops.wm.open_mainfile(filepath=str(blend))
        assert [p.exists() for p in files] == [False, False, True, True, True, True]


def test_materials_are_fitted_with_user_basis() -> None:
    """Three synthetic files stand in for the hundred genuine ones; the export finds the basis."""
    basis, brdf = extension("core.basis"), extension("core.brdf")
    merl, place, cache = extension("core.basis.merl_folder"), folder(), folder()
    default = basis.default_basis()
    for k, name in enumerate("abcdefgh"):
        own = basis.PrincipalBRDF(default, default.training[15 * k : 15 * k + 3])
        table = brdf.TabulatedBRDF.from_function(own.evaluate)
        brdf.merl_file.write(place / f"{name}.binary", table)
    sums = {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in place.glob("*.binary")}
    imported("[fit]\nmethod = 'paper'\nheld_out = false\ntrials = 20\nsamples = 3")
    usual, merl.checksums = merl.checksums, lambda: sums
    try:
        with preferred(merl_folder=str(place), cache_folder=str(cache)):
            # a child process would compare them with the checksums of the genuine files
            kept = extension("scene.material.file_cache")
            kept.keep_basis(kept.basis_source(), kept.own_basis()())
            assert bpy.ops.patina.fit() == {"FINISHED"}
            scene, properties = bpy.context.scene, extension("scene.session.scene_properties")
            stored_basis = properties.stored_result(properties.capture_path(scene))["basis"]
            assert (
                stored_basis["columns"] == 3 * len(sums)
                and stored_basis["version"] != default.version
            )
            assert [p.name for p in cache.glob("merl_basis_*.npz")]
            out = {"directory": str(place), "folder": "out", "formats": {"binary"}}
            assert bpy.ops.patina.export(**out) == {"FINISHED"}
        with preferred(merl_folder=str(cache), cache_folder=str(cache)):
            try:
                bpy.ops.patina.fit()
            except RuntimeError as error:
                assert "MERL files are missing" in str(error) and "Traceback" not in str(error)
            else:
                raise AssertionError("a folder without the files was accepted")
    finally:
        merl.checksums = usual
