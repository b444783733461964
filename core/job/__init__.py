"""Long work as one object with step(): scripts drain it, Blender steps it on a timer."""

from .fit_job import CaptureResult, FitJob, MaterialResult
from .job import Job, Stage, finished

__all__ = ["CaptureResult", "FitJob", "Job", "MaterialResult", "Stage", "finished"]
