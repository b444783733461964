"""Charts of a measured material: they are stored in the .blend, show the measurement, and are
updated.
"""

from __future__ import annotations

import bpy
import numpy as np
from support import extension
from test_workflow import folder, make_capture_module

FIT = "[fit]\nheld_out = false"


_fitted: list[str] = []  # the .blend of the one fit that all tests here use


def fitted() -> bpy.types.Material:
    """A fitted material; the first time with its fit in memory, then in a file of its own."""
    if _fitted:
        bpy.ops.wm.open_mainfile(filepath=_fitted[0])
        bpy.ops.wm.save_as_mainfile(filepath=str(folder() / "own.blend"))
        return bpy.data.materials["surface"]
    path = make_capture_module().make_capture(folder() / "ball", photos=3, extra=FIT)
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    assert bpy.ops.patina.fit() == {"FINISHED"}
    _fitted.append(str(folder() / "fitted.blend"))
    bpy.ops.wm.save_as_mainfile(filepath=_fitted[0], copy=True)
    return bpy.data.materials["surface"]


def in_memory() -> bool:
    """Whether the fit itself is still in memory."""
    return extension("scene.session.last_fit")._last.value is not None


def pixels(image: bpy.types.Image) -> np.ndarray:
    found = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(found)
    return found.reshape(image.size[1], image.size[0], 4)


def view(kind: str) -> bpy.types.Image:
    assert bpy.ops.patina.show_chart(kind=kind) == {"FINISHED"}
    return extension("scene.views.view_image").view_image(kind)


def test_material_stores_samples_and_interval() -> None:
    """Its samples and its interval are those of the fit."""
    assert not bpy.ops.patina.show_chart.poll(), "nothing to show before a fit"
    material = fitted()
    subject = extension("scene.material.material_evidence").subject_of(material)
    assert 100 < len(subject.points) <= 6000 and subject.interval is not None
    if not in_memory():  # another test ran first
        bpy.ops.patina.fit()
        subject = extension("scene.material.material_evidence").subject_of(
            bpy.data.materials["surface"]
        )
    job = extension("scene.session.last_fit")._last.value
    kept_points, points = job.materials[0].points, subject.points
    assert np.array_equal(points.rho, kept_points.rho)
    low, high = subject.interval(points.angles)
    mine = job.materials[0].fit.interval(points.angles)
    assert np.allclose(low, mine[0], rtol=1e-5) and np.allclose(high, mine[1], rtol=1e-5)
    inside = ((points.rho > 0.5 * low) & (points.rho < 2 * high)).mean()
    assert inside > 0.5, f"{inside:.2f} of the samples are near the interval of the fit to them"


def test_all_charts_are_shown_and_survive_reload() -> None:
    fitted()
    pictures = {}
    for kind in ("sphere", "polar", "highlight", "slice", "interval"):
        pictures[kind] = pixels(view(kind))
        assert pictures[kind][..., :3].std() > 0.02, kind
    views = bpy.context.scene.patina_views
    assert views.shown == "interval"
    best = extension("core.views.charts").best_sampled_theta_d(
        extension("scene.material.material_evidence").subject_of(bpy.data.materials["surface"])
    )
    assert abs(np.degrees(views.theta_d) - best) < 0.01, "the slice lies where most samples are"
    path = str(folder() / "views.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    find = extension("scene.views.view_image").view_image
    assert np.array_equal(pixels(find("slice")), pictures["slice"]), "the image was not packed"
    assert np.array_equal(pixels(view("highlight")), pictures["highlight"])


def test_chart_follows_its_settings() -> None:
    fitted()
    views = bpy.context.scene.patina_views
    image = view("polar")
    before = pixels(image)
    for name, value in (("scale", "log"), ("channels", "g"), ("cosine", True), ("incidence", 1.0)):
        setattr(views, name, value)
        after = pixels(image)
        assert not np.array_equal(after, before), name
        before = after
    assert len([i for i in bpy.data.images if "patina_view" in i]) == 1


def test_fits_are_compared() -> None:
    material = fitted()
    charted, views = extension("scene.material.material_evidence"), bpy.context.scene.patina_views
    views.against = "EARLIER"
    assert not charted.has_earlier(material)
    try:
        bpy.ops.patina.show_chart(kind="ratio")
    except RuntimeError as error:
        assert "fitted only once" in str(error)
    else:
        raise AssertionError("a ratio without an earlier fit")
    charted.keep_earlier(material, material.copy())
    assert not charted.has_earlier(material), "an identical fit is not kept for comparison"
    material["patina_coefficients"] = [1.2 * c for c in material["patina_coefficients"]]
    changed = list(material["patina_coefficients"])
    assert bpy.ops.patina.fit() == {"FINISHED"}
    material = bpy.data.materials["surface"]
    assert material.name == "surface" and list(material["patina_earlier_coefficients"]) == changed
    alone = pixels(view("ratio"))
    views.against = "CHANGED"
    assert not np.array_equal(pixels(view("ratio")), alone), (
        "without shifts the ratio is to the fit itself"
    )
    views.against = "MATERIAL"
    views.other = material
    same = pixels(view("ratio"))[150, 400, :3]
    assert np.allclose(same, same[0], atol=0.01), "a material differs from itself"
    views.against = "FILE"
    path = folder() / "itself.binary"
    extension("core.brdf.merl_file").write(
        path,
        extension("core.brdf").TabulatedBRDF.from_function(charted.subject_of(material).evaluate),
    )
    views.file = str(path)
    same = pixels(view("ratio"))[150, 400, :3]
    assert np.allclose(same, same[0], atol=0.05), "its own table differs"


def test_photo_view_after_fit_and_after_reload() -> None:
    fitted()
    scene, listed = bpy.context.scene, extension("scene.photos.photo_list")
    scene.camera = None
    assert not bpy.ops.patina.look_at_photo.poll(), "no photo is shown"
    scene.patina_photos.active = 1
    assert listed.looked_at(scene) is not None
    find = extension("scene.views.view_image").view_image
    for kind in ("comparison", "samples"):
        assert bpy.ops.patina.look_at_photo(kind=kind) == {"FINISHED"}
    comparison, samples = pixels(find("comparison")), pixels(find("samples"))
    assert comparison[..., :3].std() > 0.05 and samples[..., :3].std() > 0.05
    reliable = np.abs(samples[..., :3] * 255 - [0, 147, 155]).max(axis=-1) < 90
    assert reliable.mean() > 0.05, "the photo has reliable pixels"
    bpy.context.scene.patina_views.shown = "comparison"
    bpy.context.scene.patina_views.exposure = -3.0
    darker = pixels(find("comparison"))
    assert darker.shape != comparison.shape or darker.mean() < comparison.mean()
    bpy.context.scene.patina_views.exposure = 0.0
    path = str(folder() / "looked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert not in_memory()
    bpy.context.scene.patina_photos.active = 1
    assert bpy.ops.patina.look_at_photo(kind="comparison") == {"FINISHED"}
    again = pixels(find("comparison"))
    assert np.allclose(again, comparison, atol=2 / 255), np.abs(again - comparison).max()
