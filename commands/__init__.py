"""The headless commands, one a file: parse, call core and scene, write into place.

Each module has ``add_arguments(parser)`` and ``run(arguments) -> None``; a PatinaError is the
user's mistake and becomes one line and exit code 2 (headless.py).
"""
