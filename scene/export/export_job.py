"""The materials of the open .blend for other programs, as ``headless material`` exports them.

What was measured is in the .blend as result.json has it; it is laid down in a folder for the time
being, with a copy of the .blend as the scene.blend of a result, and the command's own functions do
the rest. Formats that Blender writes open files of their own: a second Blender does that.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from typing import Any

import bpy

from ...core.concurrency.job import Job, Step
from ...core.errors import InputError, PatinaError
from ...core.export import Loss
from ...core.export.material_formats import BLENDER, export_materials
from ...core.jobs import CaptureResult
from ...core.output_folder import check_out, staged_folder
from ...core.report import write_report
from ...core.report.result_json import write_json
from ...core.result import read_result
from ..session.background_blender import in_background
from ..session.last_fit import kept_fit
from ..session.scene_properties import DIAGNOSIS, capture_path, stored_result
from .export_choice import FORMATS, RECORD, REPORT, missing

MARKS = ("losses.txt", "result.json", "report/index.html")  # of an earlier export
FIT = ("scene.blend",)  # of a folder that `fit` left: the record of the fit itself


class ExportJob(Job):
    """Write what a scene's last fit found into a folder. formats: words of FORMATS; cache: folder
    of bases from the user's own MERL files. Raises PatinaError."""

    def __init__(
        self, scene: bpy.types.Scene, formats: Sequence[str], out: Path, cache: Path
    ) -> None:
        super().__init__()
        capture = capture_path(scene)
        found = stored_result(capture)
        if found is None:
            raise PatinaError("nothing is measured yet: fit the materials first")
        if not formats:
            raise InputError("choose at least one format", key="formats")
        for word in formats:
            reason = missing(scene, word)
            if reason is not None:
                raise PatinaError(reason)
        self.found, self.out, self.cache = found, check_out(out), cache
        _check_own(self.out)
        self.diagnosis = stored_result(capture, DIAGNOSIS)
        self.fit: CaptureResult | None = kept_fit(capture, found)
        self.formats = [word for word in FORMATS if word in formats]
        self.losses: list[Loss] = []
        self.files: list[str] = []

    def run(self) -> Iterator[Step]:
        """The record and the report, then what the command writes."""
        told = [word for word in self.formats if word not in (RECORD, REPORT)]
        yield from self._own_files()
        if not told:
            return
        with tempfile.TemporaryDirectory(prefix="patina-", ignore_cleanup_errors=True) as folder:
            result = Path(folder)
            write_json(result / "result.json", self.found)
            if set(told) & set(BLENDER):
                yield Step("copying the scene", 0.0)
                _save_copy(result / "scene.blend")
                yield from self._by_another_blender(result, told)
            else:
                fitted = read_result(result, self.cache)
                self.losses, _ = yield from export_materials(self.out, fitted, told)
        self.files += ["losses.txt", "losses.json"]
        self.files += sorted({file for loss in self.losses for file in loss.files})

    def _by_another_blender(self, result: Path, told: list[str]) -> Generator[Step, None, None]:
        words = ["material", str(result), "--to", *told, "--out", str(self.out)]
        yield from in_background(words, {"PATINA_CACHE": str(self.cache)})
        content = json.loads((self.out / "losses.json").read_text("utf-8"))
        for loss in content["losses"]:
            lists = {key: tuple(loss[key]) for key in ("files", "dropped", "notes")}
            self.losses.append(Loss(**{**loss, **lists}))

    def _own_files(self) -> Generator[Step, None, None]:
        """What a fit leaves beside the materials."""
        records: dict[str, dict[str, Any] | None] = {}
        if RECORD in self.formats:
            records = {"result.json": self.found, "diagnosis.json": self.diagnosis}
        report = REPORT in self.formats
        if not records and not report:
            return
        with staged_folder(self.out) as folder:
            for name, content in records.items():
                if content is not None:
                    write_json(folder / name, content)
                    self.files.append(name)
            if report and self.fit is not None:
                for fraction in write_report(folder / "report", self.fit):
                    yield Step("writing the report", fraction)
                self.files.append("report/index.html")


def _check_own(out: Path) -> None:
    """Refuse a folder with something in it that no earlier export left: files are replaced by
    name, and the scan's own may have the names."""
    if not out.is_dir() or not any(out.iterdir()):
        return
    exported = any((out / mark).is_file() for mark in MARKS)
    if exported and not any((out / name).exists() for name in FIT) and not any(out.glob("*.toml")):
        return
    raise InputError(
        "holds files that are no earlier export; expected an empty folder, or a new one", file=out
    )


def _save_copy(path: Path) -> None:
    """The open .blend as it is now, saved or not; the open one stays what it is."""
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, check_existing=False)
    except RuntimeError as error:
        said = " ".join(str(error).split())
        raise PatinaError(f"a copy of the scene cannot be saved ({said})") from error
