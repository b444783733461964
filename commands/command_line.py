"""The command line of Patina: one parser and one dispatch, for headless.py and for ``patina``."""

from __future__ import annotations

import argparse
import importlib
import signal
import sys
from collections.abc import Sequence
from typing import NoReturn

from ..core.errors import PatinaError

DONE, WRONG_INPUT, INTERRUPTED = 0, 2, 130  # exit codes; 130 is the shells' own for SIGINT

COMMANDS = {
    "fit": "fit",
    "diagnose": "diagnose",
    "import": "import_",
    "masks": "masks",
    "maps": "maps",
    "solve": "solve",
    "localise": "localise",
    "demo": "demo",
    "basis": "basis",
    "build-basis": "build_basis",
    "compare": "compare",
    "material": "material",
    "render": "render",
}
"""Command → its module in this folder, which has HELP, add_arguments(parser) and run(arguments)."""


def main(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code: 0 when all was done, 2 for wrong input (one line
    on stderr), 130 when it was interrupted by ctrl-C or SIGTERM.

    arguments: the words after the program's name. Raises SystemExit for wrong usage (code 2) and
    for ``--help`` (code 0), as argparse does.
    """
    modules = {
        command: importlib.import_module(f".{file}", __package__)
        for command, file in COMMANDS.items()
    }
    signal.signal(signal.SIGTERM, _interrupt)  # after the libraries, some of which set their own
    parser = _Parser(prog="patina", description="Measured materials from photo scans")
    choices = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command, module in modules.items():
        module.add_arguments(choices.add_parser(command, help=module.HELP))
    parsed = parser.parse_args(arguments)
    try:
        modules[parsed.command].run(parsed)
    except PatinaError as error:
        print(f"patina: {error}", file=sys.stderr)
        return WRONG_INPUT
    except KeyboardInterrupt:
        print("patina: stopped; nothing was written", file=sys.stderr)
        return INTERRUPTED
    return DONE


def console() -> NoReturn:
    """The entry point of the console script ``patina``."""
    sys.exit(main(sys.argv[1:]))


class _Parser(argparse.ArgumentParser):
    """A mistake on the command line is one line too."""

    def error(self, message: str) -> NoReturn:
        self.exit(WRONG_INPUT, f"{self.prog}: {message} (--help says more)\n")


def _interrupt(*_: object) -> NoReturn:
    raise KeyboardInterrupt
