"""Long work as one object with step(): scripts drain it, Blender steps it on a timer."""

from ..concurrency.job import Job, Stage, finished
from .fit_job import CaptureResult, FitJob, MaterialResult

__all__ = ["CaptureResult", "FitJob", "Job", "MaterialResult", "Stage", "finished"]
