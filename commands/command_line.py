"""Parser and dispatch of Patina's command line, used by headless.py and the script ``patina``."""

from __future__ import annotations

import argparse
import importlib
import os
import signal
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import NoReturn

from ..core.child_process.parent_watch import END_WITH_PARENT, end_with_parent
from ..core.errors import PatinaError, system_error
from .plain_output import plain_output

DONE, WRONG_INPUT, INTERRUPTED = 0, 2, 130  # exit codes; shells use 130 for SIGINT

COMMANDS = {
    "fit": "fit",
    "diagnose": "diagnose",
    "batch": "batch",
    "import": "import_",
    "masks": "masks",
    "maps": "maps",
    "solve": "solve",
    "localise": "localise",
    "find-lights": "find_lights",
    "demo": "demo",
    "basis": "basis",
    "build-basis": "build_basis",
    "predict": "predict",
    "compare": "compare",
    "material": "material",
    "render": "render",
}
"""Command → module in this folder with HELP, add_arguments(parser) and run(arguments)."""


def main(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code: 0 on success, 2 for wrong input (one line on
    stderr), 130 if it was interrupted by Ctrl-C or SIGTERM.

    arguments: the words after the program name. Raises SystemExit for wrong usage (code 2) and for
    ``--help`` (code 0), as argparse does.
    """
    modules = {
        command: importlib.import_module(f".{file}", __package__)
        for command, file in COMMANDS.items()
    }
    if END_WITH_PARENT in os.environ:
        end_with_parent()
    signal.signal(signal.SIGTERM, _interrupt)  # after the imports: some libraries install a handler
    parser = _Parser(prog="patina", description="Measured materials from photo scans")
    choices = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command, module in modules.items():
        module.add_arguments(choices.add_parser(command, help=module.HELP))
    parsed = parser.parse_args(arguments)
    with plain_output():
        return _run(modules[parsed.command], parsed)


def _run(command: ModuleType, parsed: argparse.Namespace) -> int:
    """Run a command; returns the exit code."""
    try:
        command.run(parsed)
    except PatinaError as error:
        print(f"patina: {error}", file=sys.stderr)
        return WRONG_INPUT
    except OSError as error:  # such as a full disk, or a network folder that is gone
        print(f"patina: {system_error(error)}", file=sys.stderr)
        return WRONG_INPUT
    except MemoryError:
        print(
            "patina: the memory was not sufficient; close other programs, or use fewer threads, "
            "smaller photos or a smaller mesh",
            file=sys.stderr,
        )
        return WRONG_INPUT
    except KeyboardInterrupt:
        print(
            "patina: Interrupted. The folder of results has the earlier files, or all new ones.",
            file=sys.stderr,
        )
        return INTERRUPTED
    return DONE


def console() -> NoReturn:
    """The entry point of the console script ``patina``."""
    sys.exit(main(sys.argv[1:]))


class _Parser(argparse.ArgumentParser):
    """Prints wrong usage as one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(WRONG_INPUT, f"{self.prog}: {message} (use --help for the options)\n")


def _interrupt(*_: object) -> NoReturn:
    raise KeyboardInterrupt
