"""Jobs in a process of their own: Blender stays responsive, and outlives a crash of the job."""

from .child_job import ChildJob

__all__ = ["ChildJob"]
