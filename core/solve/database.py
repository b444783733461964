"""The photos' features in a COLMAP database, the input of its matcher and mapper."""

from __future__ import annotations

from pathlib import Path

import pycolmap

from .features import Features
from .photo_set import LensKey


class FeatureStore:
    """A COLMAP database under construction. Photos are named 0, 1, … in it, because COLMAP's lists
    of pairs cannot hold names with spaces. One camera for every LensKey."""

    def __init__(self, path: Path, model: str) -> None:
        self.path, self.model = path, model
        self._database = pycolmap.Database.open(path)
        self._rigs: dict[LensKey, tuple[int, int]] = {}

    def add(self, number: int, key: LensKey, focal: tuple[float, bool], found: Features) -> None:
        """Add one photo. focal: (pixels, whether it comes from Exif)."""
        rig_id, camera_id = self._rigs.get(key) or self._new_camera(key, focal)
        image_id = self._database.write_image(pycolmap.Image(name=str(number), camera_id=camera_id))
        frame = pycolmap.Frame()
        frame.rig_id = rig_id
        frame.add_data_id(pycolmap.data_t(_sensor(camera_id), image_id))
        self._database.write_frame(frame)
        self._database.write_keypoints(image_id, found.keypoints)
        data = pycolmap.FeatureDescriptors(
            type=pycolmap.FeatureExtractorType.SIFT, data=found.descriptors
        )
        self._database.write_descriptors(image_id, data)

    def verified(self) -> dict[str, tuple[int, int]]:
        """Photo → (number of photos with verified matches, total number of matched points)."""
        names = {image.image_id: image.name for image in self._database.read_all_images()}
        totals = dict.fromkeys(names.values(), (0, 0))
        ids, counts = self._database.read_two_view_geometry_num_inliers()
        for pair, count in zip(ids, counts, strict=True):
            if count > 0:
                for image_id in pycolmap.pair_id_to_image_pair(pair):
                    others, points = totals[names[image_id]]
                    totals[names[image_id]] = (others + 1, points + int(count))
        return totals

    def compared(self) -> int:
        """Number of pairs that the matcher has completed."""
        return int(self._database.num_matched_image_pairs())

    def close(self) -> None:
        self._database.close()

    def _new_camera(self, key: LensKey, focal: tuple[float, bool]) -> tuple[int, int]:
        pixels, from_exif = focal
        camera = pycolmap.Camera.create_from_model_name(
            len(self._rigs) + 1, self.model, pixels, key.width, key.height
        )
        camera.has_prior_focal_length = from_exif
        camera_id = self._database.write_camera(camera)
        rig = pycolmap.Rig()
        rig.add_ref_sensor(_sensor(camera_id))
        self._rigs[key] = (self._database.write_rig(rig), camera_id)
        return self._rigs[key]


def _sensor(camera_id: int) -> pycolmap.sensor_t:
    return pycolmap.sensor_t(pycolmap.SensorType.CAMERA, camera_id)
