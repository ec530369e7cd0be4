"""Completion of a command line in bash and zsh: without numpy, and mostly without parameters."""

import argparse
import os
from collections.abc import Iterable

from argcomplete import autocomplete
from argcomplete.completers import BaseCompleter, FilesCompleter

from stickslip_ros.cli.main import build_parser

OF_PARAMETERS = ('GROUP.NAME=', 'NAME=VALUE', 'NAME=LOW', 'NAMES')


def complete() -> None:
    """Tell the shell what may come next, and end the process."""
    parser = build_parser(os.environ['COMP_LINE'].split()[1:2])
    autocomplete(parser, always_complete_options='long', default_completer=Values())


class Values(BaseCompleter):
    """What the value of an option may be: files, names of parameters, their choices."""

    def __call__(self, *, prefix: str, action: argparse.Action, **_: object) -> Iterable[str]:
        """Return what a word may become."""
        shown = str(action.metavar)
        if shown in {'FILE', 'DIR'}:
            return list(FilesCompleter()(prefix))
        if not shown.startswith(OF_PARAMETERS):
            return []
        from stickslip_ros.parameters import specs  # noqa: PLC0415 - most words do without

        name, equals, _typed = prefix.partition('=')
        if equals:
            return [f'{name}={each}' for each in specs()[name].choices] if name in specs() else []
        others, comma, _typed = prefix.rpartition(',')
        return [f'{others}{comma}{name}{"=" * ("=" in shown)}' for name in specs()]
