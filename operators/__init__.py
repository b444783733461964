"""Thin: read properties, call core and scene, report. One file a stage of the workflow."""
