"""Long computations as Job objects with step(): scripts run them to the end, Blender steps them on
a timer."""

from ..concurrency.job import Job, Stage, finished
from .fit_job import CaptureResult, FitJob, MaterialResult

__all__ = ["CaptureResult", "FitJob", "Job", "MaterialResult", "Stage", "finished"]
