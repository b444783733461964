"""The headless commands, one per module: parse arguments, call core and scene, write the results.

Each module has ``add_arguments(parser)`` and ``run(arguments) -> None``. A PatinaError means wrong
input; command_line.py prints it as one line and returns exit code 2.
"""
