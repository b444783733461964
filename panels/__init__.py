"""Panels: one for each stage of the workflow, and the preferences page."""
