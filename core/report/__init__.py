"""The report of a fit: one HTML page with pictures and charts, and result.json for programs."""

from . import result_json
from .page import write_report

__all__ = ["result_json", "write_report"]
