"""cameras.xml of Metashape and PhotoScan: synthetic scenes with known projections, real files."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from patina.core.errors import InputError
from patina.core.scan.formats import read_reconstruction
from patina.core.scan.readers.metashape import read_metashape
from patina.core.scan.readers.metashape_frames import geodetic
from patina.core.scan.reconstruction import Similarity
from tests import make_metashape as made


def written(folder, *chunks, name="cameras.xml", **more):
    path = folder / name
    path.write_text(made.document(*chunks, **more), "utf-8")
    return path


@pytest.mark.parametrize("version", ["1.2.0", "1.4.0", "1.5.0", "2.0.0", "2.3.0"])
@pytest.mark.parametrize("seed", [0, 1])
def test_round_trip(tmp_path, version, seed):
    scene = made.scene(version, seed)
    path = written(tmp_path, made.chunk_xml(scene, version), version=version)
    found = read_reconstruction(path)
    made.agree(found, scene)
    expected_note = " ".join(found.notes)
    assert "1 disabled camera left out" in expected_note
    assert "not aligned" in expected_note
    names = {"1.2.0": "chunk transform"}.get(version, "component 0")
    R, t, scale = scene.transform or scene.components[0]
    move = found.frames[names]
    points = np.random.default_rng(1).normal(size=(10, 3))
    np.testing.assert_allclose(move.points(points), scale * points @ R.T + t, atol=1e-9)
    # the cameras see transformed points where they saw the points
    moved = found.moved(names)
    for before, after in zip(found.cameras, moved.cameras, strict=True):
        np.testing.assert_allclose(
            after.project(move.points(points)), before.project(points), atol=1e-5
        )


def test_lenses_convert_to_colmap_where_possible(tmp_path):
    scene = made.scene("2.0.0")
    found = read_reconstruction(written(tmp_path, made.chunk_xml(scene)))
    models = {c.label: c.model for c in found.cameras}
    assert models["IMG_0000"] == "METASHAPE_FRAME"
    assert models["IMG_0006"] == "FULL_OPENCV"
    assert models["S2_IMG_0000"] == "THIN_PRISM_FISHEYE"
    assert models["S3_IMG_0000"] == "SIMPLE_PINHOLE"
    assert models["S4_IMG_0000"] == "METASHAPE_FISHEYE"
    assert models["S5_IMG_0000"] == "METASHAPE_EQUISOLID"
    assert models["S7_IMG_0000"] == "EQUIRECTANGULAR"


def test_chunk_transform_as_sixteen_numbers(tmp_path):
    scene = made.simple()
    R = made.rotation(np.random.default_rng(3))
    matrix = made.motion(2.5 * R, (1.0, 2.0, 3.0))
    text = f"<transform>{' '.join(repr(float(v)) for v in matrix.ravel())}</transform>"
    found = read_reconstruction(written(tmp_path, made.chunk_xml(scene, extra=text)))
    move = found.frames["chunk transform"]
    assert move.scale == pytest.approx(2.5)
    np.testing.assert_allclose(
        move.points(np.eye(3)), matrix[:3, :3].T + np.array([1, 2, 3]), atol=1e-12
    )


def test_duplicate_labels_are_distinguished(tmp_path):
    scene = made.simple(5)
    for camera, (label, group) in zip(
        scene.cameras,
        [("A", "left"), ("A", "right"), ("A", None), ("B", "left"), ("B", "left")],
        strict=True,
    ):
        camera.label, camera.group = label, group
    found = read_reconstruction(written(tmp_path, made.chunk_xml(scene)))
    # ids follow the order of the scene: the two B are 3 and 4
    assert [c.label for c in found.cameras] == [
        "A",
        "left/A",
        "left/B [3]",
        "left/B [4]",
        "right/A",
    ]
    assert any("renamed" in note for note in found.notes)


def test_rig_with_two_levels_of_sensors(tmp_path):
    """The master in the cameras need not be the sensors' master."""
    rng = np.random.default_rng(2)
    offsets = [made.motion(made.rotation(rng), rng.normal(size=3) * 0.1) for _ in range(2)]
    scene = made.simple(2)
    scene.sensors = [made.Sensor(values=made.BROWN, offset=(o[:3, :3], o[:3, 3])) for o in offsets]
    slave = scene.cameras[1]
    slave.sensor, slave.master = 1, 0
    slave.matrix = scene.cameras[0].matrix @ np.linalg.inv(offsets[0]) @ offsets[1]
    found = read_reconstruction(written(tmp_path, made.chunk_xml(scene)))
    poses = {c.label: c.pose for c in found.cameras}
    np.testing.assert_allclose(poses["IMG_0001"].centre, slave.matrix[:3, 3], atol=1e-12)
    np.testing.assert_allclose(poses["IMG_0001"].rotation, slave.matrix[:3, :3].T, atol=1e-12)


def components(with_transforms):
    rng = np.random.default_rng(4)
    frames = [(made.rotation(rng), rng.normal(size=3), s) for s in (2.0, 0.5)]
    scene = made.simple(4, component=0)
    world = [c.matrix for c in scene.cameras]
    for number, camera in enumerate(scene.cameras):
        camera.component = number // 2
        if camera.component == 1:  # the same place in the world, in the other frame
            (R0, t0, s0), (R1, t1, s1) = frames
            place = R1.T @ (s0 * R0 @ camera.matrix[:3, 3] + t0 - t1) / s1
            camera.matrix = made.motion(R1.T @ R0 @ camera.matrix[:3, :3], place)
    scene.components = dict(enumerate(frames if with_transforms else [None, None]))
    return scene, world


@pytest.mark.parametrize("active", [0, 7])
def test_georeferenced_components_are_merged(tmp_path, active):
    scene, first_frame = components(True)
    scene.active = active
    found = read_reconstruction(written(tmp_path, made.chunk_xml(scene)))
    whole = replace(
        scene,
        cameras=[replace(c, matrix=m) for c, m in zip(scene.cameras, first_frame, strict=True)],
    )
    made.agree(found, whole)
    assert list(found.frames) == ["component 0"]
    assert any("2 components" in note for note in found.notes)


def test_components_without_world_frame_are_left_out(tmp_path):
    scene, _ = components(False)
    scene.active = 1
    found = read_reconstruction(written(tmp_path, made.chunk_xml(scene)))
    assert [c.label for c in found.cameras] == ["IMG_0002", "IMG_0003"]
    assert any("2 cameras of other components left out" in note for note in found.notes)


def test_rig_camera_belongs_to_component_of_its_master(tmp_path):
    scene, _ = components(False)
    slave = scene.cameras[3]
    slave.component, slave.master = None, 2
    scene.active = 1
    found = read_reconstruction(written(tmp_path, made.chunk_xml(scene)))
    assert [c.label for c in found.cameras] == ["IMG_0002", "IMG_0003"]


class TestChunks:
    def chunks(self, posed=("a", "b"), others=("c",)):
        texts = []
        for number, label in enumerate((*posed, *others)):
            scene = made.simple()
            scene.label = label
            for camera in scene.cameras:
                camera.label = f"{label}{camera.label}"
                camera.aligned = label in posed
            texts.append(made.chunk_xml(scene, attributes=f'id="{number}"'))
        return texts

    def test_by_label(self, tmp_path):
        path = written(tmp_path, *self.chunks())
        assert read_reconstruction(path, chunk="b").cameras[0].label == "bIMG_0000"

    def test_active_chunk(self, tmp_path):
        found = read_reconstruction(written(tmp_path, *self.chunks(), active=1))
        assert found.cameras[0].label == "bIMG_0000"
        assert "active" in found.notes[0]

    def test_only_chunk_with_poses(self, tmp_path):
        found = read_reconstruction(written(tmp_path, *self.chunks(("a",), ("b", "c")), active=1))
        assert found.cameras[0].label == "aIMG_0000"

    def test_ambiguous_chunk_is_not_guessed(self, tmp_path):
        with pytest.raises(InputError, match=r"2 chunks with aligned cameras.*'a', 'b', 'c'"):
            read_reconstruction(written(tmp_path, *self.chunks()))

    def test_unknown_label_is_rejected(self, tmp_path):
        with pytest.raises(InputError, match="no chunk 'z'; expected one of 'a', 'b', 'c'"):
            read_reconstruction(written(tmp_path, *self.chunks()), chunk="z")

    def test_duplicate_chunk_label_is_rejected(self, tmp_path):
        with pytest.raises(InputError, match="2 chunks with the label 'a'"):
            read_reconstruction(written(tmp_path, *self.chunks(("a", "a"), ())), chunk="a")


def ecef(latitude, longitude, altitude):
    """Geocentric metres of a place in degrees: the textbook's closed form on WGS84."""
    phi, lam = math.radians(latitude), math.radians(longitude)
    flattening = 1 / 298.257223563
    e2 = flattening * (2 - flattening)
    normal = 6378137.0 / math.sqrt(1 - e2 * math.sin(phi) ** 2)
    return np.array(
        [
            (normal + altitude) * math.cos(phi) * math.cos(lam),
            (normal + altitude) * math.cos(phi) * math.sin(lam),
            (normal * (1 - e2) + altitude) * math.sin(phi),
        ]
    )


POSITIONS = [(35.7, 139.5, 60.0), (-33.9, 18.4, 1085.0), (0.0, -180.0, -5.0), (89.99, 12.0, 3000.0),
          (-64.8, -64.1, 10.0), (51.5, 0.0, 8849.0)]  # fmt: skip


@pytest.mark.parametrize("place", POSITIONS)
def test_georeference_of_local_frame(tmp_path, place):
    latitude, longitude, altitude = place
    rng = np.random.default_rng(7)
    scene = made.simple(8)
    scene.reference = made.WGS84
    scale, R = 3.5, made.rotation(rng)
    centre = np.mean([c.matrix[:3, 3] for c in scene.cameras], axis=0)
    scene.transform = R, ecef(*place) - scale * R @ centre, scale
    geo = read_reconstruction(written(tmp_path, made.chunk_xml(scene))).georeference
    assert geo.latitude == pytest.approx(latitude, abs=1e-9)
    assert abs((geo.longitude - longitude + 180) % 360 - 180) < 1e-8
    assert geo.altitude == pytest.approx(altitude, abs=1e-4)
    # a step of the frame's north, east, up is one in latitude, longitude, altitude
    step = 1e-5
    for axis, moved in (
        (geo.north, (latitude + step, longitude, altitude)),
        (geo.east, (latitude, longitude + step, altitude)),
        (geo.up, (latitude, longitude, altitude + 1.0)),
    ):
        towards = R.T @ (ecef(*moved) - ecef(*place))
        np.testing.assert_allclose(axis, towards / np.linalg.norm(towards), atol=1e-5)


def test_local_or_absurd_position_has_no_georeference(tmp_path):
    scene = made.simple()
    scene.transform = np.eye(3), np.zeros(3), 1.0
    assert read_reconstruction(written(tmp_path, made.chunk_xml(scene))).georeference is None
    scene.reference = made.WGS84
    found = read_reconstruction(written(tmp_path, made.chunk_xml(scene)))
    assert found.georeference is None
    assert any("Earth's surface" in note for note in found.notes)


def test_georeference_at_poles_and_centre_of_earth():
    latitude, _, altitude = geodetic(np.array([0.0, 0.0, 6356752.314245179]))
    assert math.degrees(latitude) == pytest.approx(90.0) and abs(altitude) < 1e-6
    assert all(math.isfinite(v) for v in geodetic(np.zeros(3)))


@pytest.mark.parametrize(
    ("extra", "expected_note"),
    [
        ("<rolling_shutter><rotation>1 0 0 0 1 0 0 0 1</rotation></rolling_shutter>", "Rolling"),
    ],
)
def test_ignored_data_is_noted(tmp_path, extra, expected_note):
    scene = made.simple()
    scene.cameras[0].extra = extra
    found = read_reconstruction(written(tmp_path, made.chunk_xml(scene)))
    assert any(expected_note in note for note in found.notes)
    made.agree(found, scene)


def test_initial_calibration_is_used_only_as_fallback(tmp_path):
    scene = made.simple()
    text = made.chunk_xml(scene)
    other = made.Sensor(values={"f": 999.0}, adjusted=False)
    both = text.replace("<calibration", made._calibration(other, False) + "<calibration", 1)
    made.agree(read_reconstruction(written(tmp_path, both)), scene)
    scene.sensors[0].adjusted = False
    found = read_reconstruction(written(tmp_path, made.chunk_xml(scene)))
    made.agree(found, scene)
    assert any("initial calibration" in note for note in found.notes)


def test_viewpoints_and_markers_are_not_cameras(tmp_path):
    text = made.chunk_xml(made.simple())
    matrix = "<transform>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</transform>"
    text = text.replace("</cameras>", f'<camera id="70" label="view">{matrix}</camera></cameras>')
    text = text.replace("</cameras>", '<markers><marker id="1"/></markers></cameras>')
    found = read_reconstruction(written(tmp_path, text))
    assert len(found.cameras) == 3
    assert "1 viewpoint without a photo left out." in found.notes


@pytest.mark.parametrize(
    ("kind", "size", "expected_note"),
    [
        ("cylindrical", (4000, 3000), "has the type 'cylindrical'"),
        ("rpc", (4000, 3000), "has the type 'rpc'"),
        ("spherical", (4000, 3000), "is a panorama of 4000 × 3000"),
    ],
)
def test_unsupported_lenses_are_named(tmp_path, kind, size, expected_note):
    scene = made.simple()
    scene.sensors[0] = made.Sensor(kind, *size, values={"f": 1000.0}, label="Pan 3")
    with pytest.raises(InputError, match=f"cameras.xml:\\d+: 'Pan 3' {expected_note}"):
        read_reconstruction(written(tmp_path, made.chunk_xml(scene)))


# ------------------------------------------------------------------------------ real files


def test_photoscan_1_2_example(tmp_path):
    """Calibration as in a PhotoScan 1.2 file from a forum: absolute cx, cy."""
    text = made.chunk_xml(made.simple(), "1.2.0")
    start, end = text.index("<calibration"), text.index("</calibration>")
    text = (
        text[:start]
        + '<calibration type="frame" class="adjusted"><resolution width="4032" height="3024"/>'
        "<fx>3261.6371538043468</fx><fy>3261.6371538043468</fy><cx>2016</cx><cy>1512</cy>"
        + text[end:]
    )
    camera = read_reconstruction(written(tmp_path, text, version="1.2.0")).cameras[0]
    assert (camera.model, camera.parameters) == (
        "SIMPLE_PINHOLE",
        (3261.6371538043468, 2016.0, 1512.0),
    )


@pytest.mark.parametrize(
    ("name", "count", "frames", "notes"),
    [
        ("michaelt919_Kintsugi3DBuilder_Rodin_399cameras.xml", 397, ["chunk transform"],
         ["2 of 399 cameras left out: not aligned."]),
        ("nobuyuki83_delfem2_camera.xml", 20, [], []),
    ],
)  # fmt: skip
def test_real_files(shared, name, count, frames, notes):
    found = read_reconstruction(shared / "data" / "cameras" / "metashape" / name)
    assert len(found.cameras) == count
    assert list(found.frames) == frames
    assert list(found.notes) == notes
    assert found.georeference is None


def test_template_without_cameras_is_rejected(shared):
    path = shared / "data" / "cameras" / "metashape" / "hollydinkel_astrobeecd_cameras_template.xml"
    with pytest.raises(InputError, match="holds no cameras; expected a chunk with aligned photos"):
        read_metashape(path, None, None)


def test_bronze_mesh_projects_into_its_photos(shared):
    """Calibrated at 8688 × 5792, shipped at a quarter; the mesh lies in the chunk's frame."""
    from patina.core.scan import scan as scans

    folder = shared / "data" / "real" / "rodin_bronze"
    read = scans.read_scan(folder / "cameras.xml", folder / "mesh.ply")
    first = read.camera("231016_miaEURO_9506").resized(2172, 1448)
    lens = first.lens
    assert lens.focal_length_x == pytest.approx(1499.5648, abs=1e-4)
    assert lens.principal_point_x == pytest.approx(1087.3327, abs=1e-4)
    assert lens.principal_point_y == pytest.approx(719.4692, abs=1e-4)
    assert not any("is in the frame" in note for note in read.notes)
    # its 16 photos show all of the figure that the mesh covers; in the chunk's world frame they
    # would not
    labels = {photo.stem for photo in (folder / "photos").iterdir()}
    shown = [camera for camera in read.cameras if camera.label in labels]
    assert len(shown) == 16
    assert scans.seen_fraction(shown, read.mesh) > 0.995
    world = read_reconstruction(folder / "cameras.xml").moved("chunk transform").cameras
    elsewhere = [camera for camera in world if camera.label in labels]
    assert scans.seen_fraction(elsewhere, read.mesh) < 0.9


def test_frame_similarities_compose():
    from patina.core.scan.readers.metashape_frames import between

    rng = np.random.default_rng(1)
    a, b = (Similarity(made.rotation(rng), rng.normal(size=3), s) for s in (2.0, 0.3))
    points = rng.normal(size=(5, 3))
    np.testing.assert_allclose(b.points(between(a, b).points(points)), a.points(points), atol=1e-12)
