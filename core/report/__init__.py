"""What a person looks at: pictures, slices and one page that holds them."""

from . import result_json
from .page import write_report

__all__ = ["result_json", "write_report"]
