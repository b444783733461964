"""Sliders of a measured material: every view of it is updated, and 0 is the measured state."""

from __future__ import annotations

import time

import bpy
import numpy as np
from support import Skip, extension
from test_workflow import folder, make_capture_module

FIT = "[fit]\nheld_out = false"


_fitted: list[str] = []  # the .blend of the one fit that all tests here use


def measured() -> bpy.types.Material:
    """A fitted material, in a file for this test."""
    if not _fitted:
        path = make_capture_module().make_capture(folder() / "ball", photos=3, extra=FIT)
        assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
        assert bpy.ops.patina.fit() == {"FINISHED"}
        _fitted.append(str(folder() / "fitted.blend"))
        bpy.ops.wm.save_as_mainfile(filepath=_fitted[0])
    bpy.ops.wm.open_mainfile(filepath=_fitted[0])
    bpy.ops.wm.save_as_mainfile(filepath=str(folder() / "own.blend"))
    material = bpy.data.materials["surface"]
    moved = extension("scene.material.trait_offsets")
    extension("scene.material.preview").show_sphere(material, moved.measured_brdf(material))
    return material


class QuickFits:
    """Immediate fits of portable models: the order of updates is tested, not their quality."""

    def __enter__(self):
        self.module = extension("core.views.prepared_materials")
        self.fits = self.module.fit_principled, self.module.fit_lobe_stack
        principled, lobes = self.fits
        self.module.fit_principled = lambda evaluate: principled(evaluate, False, (10, 4, 3))
        self.module.fit_lobe_stack = lambda evaluate: lobes(evaluate, 1, False)
        return extension("scene.material.trait_update")

    def __exit__(self, *_):
        self.module.fit_principled, self.module.fit_lobe_stack = self.fits


def preview(material: bpy.types.Material) -> np.ndarray:
    found = material.preview
    return np.array(found.image_pixels_float[:]).reshape(*reversed(found.image_size), 4)


def material_state(material: bpy.types.Material) -> dict:
    """All that a slider may change, as exact values."""
    parts = extension("scene.material.measured_nodes")
    state = {
        "coefficients": list(material["patina_coefficients"]),
        "solid": (*material.diffuse_color, material.metallic, material.roughness),
        "files": [
            material.get(k) for k in extension("scene.material.osl_files").PROPERTIES.values()
        ],
    }
    nodes = {"principled": parts.principled_node(material), "lobes": parts.lobe_node(material)}
    for i, node in enumerate(extension("scene.material.osl_files").script_nodes(material)):
        nodes[f"shader {i}"] = node
    for name, node in nodes.items():
        inputs = {s.identifier: s.default_value for s in node.inputs if hasattr(s, "default_value")}
        plain = (str, int, float)
        values = {k: v if isinstance(v, plain) else tuple(v) for k, v in inputs.items()}
        state[name] = (node.label, values)
    return state


def coefficients(material: bpy.types.Material) -> np.ndarray | None:
    """(3, 8) of the OSL shader; None where there is none."""
    found = extension("scene.material.osl_files").script_nodes(material)
    if not found:
        return None
    sockets = {s.identifier: s for s in found[0].inputs}
    return np.array([sockets[f"coefficient_{i + 1}"].default_value[:] for i in range(8)]).T


def test_preview_and_shader_update_immediately() -> None:
    material = measured()
    stored, first = list(material["patina_coefficients"]), preview(material)
    as_fitted = coefficients(material)
    material.patina_traits.every.trait_1 = 0.5
    material.patina_traits.every.trait_2 = -1.0
    material.patina_traits.red.trait_2 = 0.25
    assert list(material["patina_coefficients"]) == stored
    step = 1 / np.sqrt(300)
    expected = np.array(stored).reshape(3, -1)[:, :8].copy()
    expected[:, 0] += 0.5 * step
    expected[:, 1] += np.array([-0.75, -1.0, -1.0]) * step
    if as_fitted is not None:
        np.testing.assert_allclose(coefficients(material), expected, rtol=1e-6)
        assert not np.allclose(as_fitted, expected, atol=step / 4)
    moved = extension("scene.material.trait_offsets")
    np.testing.assert_allclose(moved.edited_brdf(material).coefficients[:, :8], expected)
    small = preview(material)
    assert small.shape[0] == moved.QUICK_SIZE
    blocks = first.reshape(moved.QUICK_SIZE, 2, moved.QUICK_SIZE, 2, 4).mean(axis=(1, 3))
    assert np.abs(small - blocks).max() > 0.2
    with QuickFits() as follow:
        follow.finish_updates()
        assert not follow.outdated_pieces(material)
    large = preview(material).reshape(moved.QUICK_SIZE, 2, moved.QUICK_SIZE, 2, 4).mean(axis=(1, 3))
    assert np.abs(small - large).mean() < 0.01, "both sizes show the same sphere"


def test_change_is_shown_within_tenth_of_second() -> None:
    material = measured()
    material.patina_traits.every.trait_1 = 0.1  # looks up what it needs
    taken = []
    for k in range(12):
        start = time.perf_counter()
        setattr(material.patina_traits.every, f"trait_{k % 8 + 1}", 0.3 + 0.02 * k)
        taken.append(time.perf_counter() - start)
    print(f"     median {1000 * np.median(taken):.0f} ms, slowest {1000 * max(taken):.0f} ms")
    assert np.median(taken) < 0.1


def test_reset_restores_measured_state_bit_for_bit() -> None:
    material = measured()
    before, sphere = material_state(material), preview(material)
    assert not bpy.ops.patina.reset_traits.poll()
    with QuickFits() as follow:
        for name, value in (("trait_1", 1.5), ("trait_4", -2.0)):
            setattr(material.patina_traits.every, name, value)
        material.patina_traits.blue.trait_3 = 0.7
        follow.finish_updates()
        assert not follow.outdated_pieces(material)
        after = material_state(material)
        assert after["coefficients"] == before["coefficients"]
        for name in ("principled", "lobes", "solid"):
            assert after[name] != before[name], name
        images = {image.name for image in bpy.data.images}
        material.patina_traits.every.trait_2 = 1.0
        follow.finish_updates()
        assert len({image.name for image in bpy.data.images} - images) <= 1
    assert bpy.ops.patina.reset_traits() == {"FINISHED"}
    assert not extension("scene.material.trait_offsets").shifts(material).any()
    assert material_state(material) == before
    np.testing.assert_array_equal(preview(material), sphere)
    assert not {"patina_traits_shown", "patina_as_measured", "patina_measured_sampling"} & {
        *material.keys()
    }
    assert not extension("scene.material.trait_update").outdated_pieces(material)


def test_slider_back_at_zero_restores_measured_state() -> None:
    material = measured()
    before, sphere = material_state(material), preview(material)
    with QuickFits() as follow:
        material.patina_traits.every.trait_1 = 1.0
        follow.finish_updates()
        material.patina_traits.every.trait_1 = 0.0
        assert material_state(material) == before
        follow.finish_updates()
        np.testing.assert_array_equal(preview(material), sphere)


def test_undo_and_redo_match_sliders() -> None:
    material = measured()
    if not bpy.ops.ed.undo_push.poll():
        raise Skip("no undo here")
    name = material.name
    before, sphere = material_state(material), preview(material)
    bpy.ops.ed.undo_push(message="fit")
    with QuickFits() as follow:
        material.patina_traits.every.trait_1 = 1.0
        bpy.ops.ed.undo_push(message="slider")  # before the background update, as Blender does
        follow.finish_updates()
        moved, shown = material_state(material), preview(material)
        bpy.ops.ed.undo()
        material = bpy.data.materials[name]
        assert material.patina_traits.every.trait_1 == 0.0
        assert material_state(material) == before
        follow.finish_updates()
        np.testing.assert_array_equal(preview(material), sphere)
        bpy.ops.ed.redo()
        material = bpy.data.materials[name]
        assert material.patina_traits.every.trait_1 == 1.0
        follow.finish_updates()
        assert material_state(material) == moved
        np.testing.assert_array_equal(preview(material), shown)
        bpy.ops.patina.reset_traits()
        assert material_state(material) == before


def test_sliders_are_saved_and_new_fit_resets_them() -> None:
    material, blend = measured(), folder() / "moved.blend"
    before = material_state(material)
    with QuickFits() as follow:
        material.patina_traits.every.trait_1 = 0.75
        bpy.ops.wm.save_as_mainfile(filepath=str(blend))  # in the background: settles
        assert not follow.outdated_pieces(material)
        moved, sphere = material_state(material), preview(material)
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    material = bpy.data.materials["surface"]
    assert material.patina_traits.every.trait_1 == 0.75
    assert material_state(material) == moved and not follow.outdated_pieces(material)
    np.testing.assert_allclose(preview(material), sphere, atol=1 / 255)
    bpy.ops.patina.reset_traits()
    again = material_state(material)
    assert again == before
    material.patina_traits.every.trait_1 = 0.75
    assert bpy.ops.patina.fit() == {"FINISHED"}
    material = bpy.data.materials["surface"]
    assert not extension("scene.material.trait_offsets").state(material)
    # not bit for bit: sums of float32 depend on where memory happens to lie
    again = np.array(material_state(material)["coefficients"])
    np.testing.assert_allclose(again, before["coefficients"], atol=0.01 * 0.75 / np.sqrt(300))


def test_timer_updates_and_stops() -> None:
    material = measured()
    before, sphere = material_state(material), preview(material)
    with QuickFits() as follow:
        material.patina_traits.every.trait_3 = 1.0
        assert bpy.app.timers.is_registered(follow._tick)
        assert follow._tick() > 0, "no update while the slider moves"
        end = time.monotonic() + 120
        while (wait := follow._tick()) is not None and time.monotonic() < end:
            time.sleep(wait)
        assert not follow.outdated_pieces(material)
        material.patina_traits.every.trait_3 = 2.0
        while follow._work is None:
            time.sleep(follow._tick())
        bpy.ops.patina.reset_traits()  # while a step is running: it comes too late
        while (wait := follow._tick()) is not None and time.monotonic() < end:
            time.sleep(wait)
        assert material_state(material) == before
        np.testing.assert_array_equal(preview(material), sphere)
        extension().unregister()
        try:
            assert not bpy.app.timers.is_registered(follow._tick)
        finally:
            extension().register()


def test_panel_warns_of_impossible_shift() -> None:
    material = measured()
    box, moved = extension("panels.traits_box"), extension("scene.material.trait_offsets")
    words = moved.slider_labels(material["patina_basis"])
    assert len(words) == 8 and all(words)
    assert not box.notes(material)
    material.patina_traits.every.trait_2 = -4.0
    notes = " ".join(line for line, _ in box.notes(material))
    assert "the albedo is" in notes and "component 2" in notes and "EEVEE" in notes
    assert extension("scene.material.trait_properties").shown_material(bpy.context) == material
    del material["patina_basis"], material["patina_coefficients"]
    assert extension("scene.material.trait_properties").shown_material(bpy.context) is None


class LayoutRecorder:
    """Records what a panel draws; only existing properties can be drawn."""

    def __init__(self) -> None:
        self.drawn: list[str] = []

    def prop(self, data, name: str, text: str = "", **_) -> None:
        assert name in data.bl_rna.properties, name
        self.drawn.append(text)

    def label(self, text: str = "", **_) -> None:
        self.drawn.append(text)

    def operator(self, name: str, **_) -> None:
        group, operator = name.split(".")
        assert operator in dir(getattr(bpy.ops, group)), name
        self.drawn.append(name)

    def template_icon(self, **_) -> None:
        pass

    def row(self, **_):
        return self

    column = row


def test_panel_draws_slider_and_effect_of_each_component() -> None:
    material = measured()
    panel, layout = extension("panels.traits_box").PATINA_PT_traits, LayoutRecorder()
    assert panel.poll(bpy.context)
    panel.draw(type("Panel", (), {"layout": layout})(), bpy.context)
    assert "1 Stronger, sharper highlight" in layout.drawn and "surface" in layout.drawn
    assert sum(line[:1].isdigit() for line in layout.drawn) == 8
    assert layout.drawn[-1] == "patina.reset_traits"
    word = extension("panels.traits_box").status_label
    assert word(material, False) == "Measured"
    material.patina_traits.green.trait_2 = -0.5
    assert word(material, False) == "Changed"
    bpy.ops.patina.mark_assets()
    assert "traits changed after the fit" in material.asset_data.description


def test_material_with_missing_basis_stays_unchanged() -> None:
    material = measured()
    before = material_state(material)
    material["patina_basis"] = "0123456789ab"
    material.patina_traits.every.trait_1 = 1.0
    assert material_state(material) == before and not bpy.ops.patina.reset_traits.poll()
    extension("scene.material.trait_update").finish_updates()
    assert material_state(material) == before
